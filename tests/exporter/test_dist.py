"""The wheel: what it carries, and what it gives to whoever installs it, in an environment that knows nothing of this
folder. Its FMUs are those in build/, for this machine alone; `make dist` puts in those for every platform.
"""

from __future__ import annotations

import email
import hashlib
import os
import shutil
import subprocess
import sys
import sysconfig
import venv
import zipfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pip
import pytest

import fmu_src
from fmu_src import cli
from fmu_src.exporter import version as installed_version
from fmu_src.exporter.build import build_fmu, build_twin
from fmu_src.exporter.compiler import host_platform
from fmu_src.exporter.dist import CHECKSUMS, make_wheel, write_checksums
from fmu_src.interface import tomllib
from fmu_src.twin.linkage import Geometry, solve
from tests.conftest import PROJECT_ROOT

BUILD = PROJECT_ROOT / "build"
PROJECT = tomllib.loads((PROJECT_ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


@pytest.fixture(scope="module")
def wheel(fmu_files, tmp_path_factory) -> Path:
    return make_wheel(BUILD, tmp_path_factory.mktemp("wheel"))


class Environment:
    """A fresh environment with the wheel installed, without network; `packages` is its site-packages."""

    def __init__(self, folder: Path, wheel: Path) -> None:
        venv.create(folder / "environment")
        self.folder = folder / "some where"
        self.folder.mkdir()
        self.scripts = folder / "environment" / ("Scripts" if os.name == "nt" else "bin")
        # pip alone, beside nothing of the tests' environment: ensurepip would take ten times as long
        shutil.copytree(Path(pip.__file__).parent, folder / "installer" / "pip")
        install = ("-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-deps", "--no-index", wheel)
        self.run("python", *install, path=folder / "installer")
        self.packages = Path(self.run("python", "-c", "import sysconfig; print(sysconfig.get_path('purelib'))").strip())

    def start(self, program: str, *arguments, path: Path | None = None) -> subprocess.CompletedProcess[str]:
        """From a folder of its own; the settings of this process do not reach it."""
        environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
        environment |= {"PYTHONPATH": str(path)} if path else {}
        command = [self.scripts / program, *arguments]
        return subprocess.run(command, cwd=self.folder, env=environment, capture_output=True, text=True, check=False)

    def run(self, program: str, *arguments, path: Path | None = None) -> str:
        done = self.start(program, *arguments, path=path)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout


@pytest.fixture(scope="module")
def bare(wheel, tmp_path_factory) -> Environment:
    """The wheel and nothing else."""
    return Environment(tmp_path_factory.mktemp("bare"), wheel)


@pytest.fixture
def installed(bare) -> Iterator[Environment]:
    """That with the packages of the tests' own environment behind it: what the wheel depends on, and the compiler.

    A folder on the path brings what lies in it, and not what its .pth files point to, which are the sources.
    """
    dependencies = bare.packages / "dependencies.pth"
    dependencies.write_text(sysconfig.get_path("purelib") + "\n", encoding="utf-8")
    yield bare
    dependencies.unlink()


def metadata_of(wheel: Path) -> email.message.Message:
    with zipfile.ZipFile(wheel) as archive:
        (name,) = [name for name in archive.namelist() if name.endswith(".dist-info/METADATA")]
        return email.message_from_bytes(archive.read(name))


# ---- what it is -----------------------------------------------------------------------------------


def test_every_file_of_the_package_is_in_it(wheel):
    """Under the package's name, with the same bytes, and the FMUs; no other. The oracle stays at home."""
    files = [
        path
        for path in (PROJECT_ROOT / "fmu_src").rglob("*")
        if path.is_file() and not {"__pycache__", "oracle"} & set(path.parts)
    ]
    wanted = {f"transplanter_linkage/{path.relative_to(PROJECT_ROOT / 'fmu_src').as_posix()}": path for path in files}
    wanted |= {f"transplanter_linkage/fmus/{name}": BUILD / name for name in fmu_src.FILES.values()}
    with zipfile.ZipFile(wheel) as archive:
        carried = {name: archive.read(name) for name in archive.namelist() if ".dist-info/" not in name}
    assert len(files) > 50 and set(carried) == set(wanted)
    assert all(carried[name] == file.read_bytes() for name, file in wanted.items())


def test_metadata(wheel):
    """One wheel for all; to look at FMUs takes no compiler."""
    assert wheel.name == f"transplanter_linkage_fmu-{PROJECT['version']}-py3-none-any.whl"
    metadata = metadata_of(wheel)
    assert (metadata["Name"], metadata["Version"]) == (PROJECT["name"], PROJECT["version"])
    assert metadata["License-Expression"] == "BSD-2-Clause" and metadata["Requires-Python"] == ">=3.10"
    needed = [line.partition(";")[0].strip() for line in metadata.get_all("Requires-Dist") if "extra" not in line]
    assert "fmpy" in needed and not {"ziglang", "pythonfmu"} & set(needed)
    assert sum("extra == 'build'" in line for line in metadata.get_all("Requires-Dist")) == 2
    with zipfile.ZipFile(wheel) as archive:
        (license_file,) = [name for name in archive.namelist() if name.endswith(".dist-info/licenses/LICENSE")]
        assert archive.read(license_file) == (PROJECT_ROOT / "LICENSE").read_bytes()


def test_the_same_bytes_again(wheel, project_copy, tmp_path):
    """From a copy in another folder, with other file times and modes."""
    for name in ("pyproject.toml", "hatch_build.py"):
        shutil.copyfile(PROJECT_ROOT / name, project_copy / name)
    for path in project_copy.rglob("*.toml"):
        path.chmod(0o600)
    again = make_wheel(BUILD, tmp_path, project_copy)
    assert again.name == wheel.name and again.read_bytes() == wheel.read_bytes()


@pytest.mark.parametrize("missing", fmu_src.FILES.values())
def test_no_wheel_without_its_fmus(missing, tmp_path):
    for name in set(fmu_src.FILES.values()) - {missing}:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes(b"")
    with pytest.raises(RuntimeError, match=f"{missing}, which the wheel carries, is missing: run make dist"):
        make_wheel(tmp_path, tmp_path)
    assert not list(tmp_path.glob("*.whl"))


def test_checksums(tmp_path):
    """As coreutils write and check them: two spaces, slashes, a line feed."""
    (tmp_path / "b folder").mkdir()
    (tmp_path / "b folder" / "c.fmu").write_bytes(b"abc")
    (tmp_path / "a.whl").write_bytes(b"")
    empty, abc = hashlib.sha256(b"").hexdigest(), hashlib.sha256(b"abc").hexdigest()
    expected = f"{empty}  a.whl\n{abc}  b folder/c.fmu\n"
    for _ in range(2):  # the second time beside the file of the first
        assert write_checksums(tmp_path).read_bytes() == expected.encode()
    assert write_checksums(tmp_path).name == CHECKSUMS


# ---- installed ------------------------------------------------------------------------------------


def test_alone_it_gives_the_paths(bare):
    """Without any other package; they are Paths of files with the bytes of build/."""
    program = (
        "import pathlib, transplanter_linkage as t\n"
        "for edition in t.FILES: assert isinstance(t.fmu(edition), pathlib.Path); print(t.fmu(edition))"
    )
    paths = [Path(line) for line in bare.run("python", "-c", program).splitlines()]
    assert [path.name for path in paths] == ["TransplanterLinkage.fmu"] * 2 + ["TransplanterLinkageTwin.fmu"]
    for path, name in zip(paths, fmu_src.FILES.values(), strict=True):
        assert path.is_relative_to(bare.packages.resolve()) and path.read_bytes() == (BUILD / name).read_bytes()


def test_alone_the_command_says_what_it_lacks(bare):
    """In one line, whatever it was asked for."""
    for command in ("info", "validate", "build"):
        done = bare.start("linkage-fmu", command, "x.fmu")
        assert done.returncode == 2 and done.stdout == ""
        assert done.stderr.startswith("linkage-fmu: No module named '") and "--no-deps" in done.stderr
        assert done.stderr.count("\n") == 1


def test_nothing_else_in_site_packages(bare):
    names = {path.name for path in bare.packages.iterdir()}
    assert names == {"transplanter_linkage", f"transplanter_linkage_fmu-{PROJECT['version']}.dist-info"}
    done = bare.start("python", "-c", "import fmu_src")
    assert "No module named 'fmu_src'" in done.stderr


def test_an_unknown_edition():
    """Also where a number was meant: 2.0 and "2.0" are too alike to guess."""
    for edition in ("1.0", "", 2.0, None, "TWIN"):
        with pytest.raises(ValueError, match=r"'2\.0', '3\.0', 'twin'") as refused:
            fmu_src.fmu(edition)
        assert repr(edition) in str(refused.value)


def test_not_built_yet(monkeypatch, tmp_path):
    monkeypatch.setattr(fmu_src, "__file__", str(tmp_path / "fmu_src" / "__init__.py"))
    with pytest.raises(FileNotFoundError, match=r"fmi3.*is missing: run make build"):
        fmu_src.fmu("3.0")


def test_it_moves(installed):
    """Both FMI versions and the twin through fmpy: half a turn on, where the mechanism in the sources has the tip."""
    program = """
import numpy as np, transplanter_linkage
from fmpy import simulate_fmu
names = ("time", "crank.phi", "crank.w", "crank.a", "machine.v", "tip.fx", "tip.fy")
inputs = np.array([(0, 0, np.pi, 0, 0, 0, 0), (1, np.pi, np.pi, 0, 0, 0, 0)], dtype=[(n, float) for n in names])
for edition in transplanter_linkage.FILES:
    result = simulate_fmu(str(transplanter_linkage.fmu(edition)), stop_time=1, output_interval=0.01, input=inputs,
                          output=["tip.x", "tip.y"], fmi_type="CoSimulation")
    print(*map(float.hex, map(float, (result["tip.x"][-1], result["tip.y"][-1]))))
"""
    tip = solve(Geometry(), np.pi).tip[0]
    lines = installed.run("python", "-c", program).splitlines()
    for line in lines:
        x, y = map(float.fromhex, line.split())
        assert abs(complex(x, y) - tip) < 1e-12
    assert len(lines) == 3 and lines[0] == lines[1]


def test_info(installed):
    said = installed.run("linkage-fmu", "info", BUILD / fmu_src.FILES["3.0"])
    assert "FMI 3.0" in said and "assembly.margin" in said
    assert said == installed.run("python", "-m", "transplanter_linkage", "info", BUILD / fmu_src.FILES["3.0"])


def test_validate(installed):
    """The pipeline's command, with the JUnit file that README names."""
    fmus = [BUILD / fmu_src.FILES["2.0"], BUILD / fmu_src.FILES["3.0"]]
    said = installed.run("linkage-fmu", "validate", *fmus, "--junit", "reports/fmu.xml")
    assert "interface" in said and (installed.folder / "reports" / "fmu.xml").is_file()


def test_build(installed, tmp_path):
    """With the compiler beside it, it builds: the same bytes as from the sources."""
    said = installed.run("linkage-fmu", "build", "--output", "out put")
    assert host_platform().name in said
    for version in (2, 3):
        build_fmu(version, tmp_path, [host_platform()])
    build_twin(tmp_path)
    for name in fmu_src.FILES.values():
        assert (installed.folder / "out put" / name).read_bytes() == (tmp_path / name).read_bytes(), name


def test_build_without_the_compiler(monkeypatch, capsys, tmp_path):
    """One line, with the command that helps, and nothing written."""
    monkeypatch.setattr(installed_version, "find_spec", lambda name: None)
    assert cli.main(["build", "--output", str(tmp_path / "nowhere")]) == 1
    assert capsys.readouterr().err == "linkage-fmu: build needs pythonfmu and ziglang: pip install pythonfmu ziglang\n"
    assert not (tmp_path / "nowhere").exists()


def test_generate_is_for_the_sources(installed):
    done = installed.start("linkage-fmu", "generate")
    assert done.returncode == 1 and "generate is for the project's sources" in done.stderr
    assert done.stderr.count("\n") == 1


def test_the_sources_answer_to_both_names(tmp_path):
    """In the development install, from any folder, the FMUs are those of build/."""
    program = "import fmu_src, transplanter_linkage as t; assert t.fmu is fmu_src.fmu; print(t.fmu('2.0'))"
    done = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert Path(done.stdout.strip()) == BUILD / fmu_src.FILES["2.0"]
