"""Reference results and parameter sets: where other tools look for them, read back, and met by the FMU itself."""

from __future__ import annotations

import hashlib
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from lxml import etree

from fmu_src.exporter import reference
from fmu_src.exporter.archive import write_archive
from fmu_src.formats import ls_ref
from fmu_src.formats.ls_ref import FOLDER, MANIFEST, UnreadableReference, deviations, read_reference, read_table

ROLES = ("parameter", "experiment/validation", "result", "document", "other")  # those of FMI-LS-REF that we use
LS = f"{{{reference.MANIFEST_NAMESPACE}}}fmi-ls-"


@pytest.fixture(scope="module")
def content(fmu_file) -> dict[str, bytes]:
    with zipfile.ZipFile(fmu_file) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


@pytest.fixture(scope="module")
def experiments(fmu_file) -> list[ls_ref.Experiment]:
    return read_reference(fmu_file)


def test_manifest(content):
    """Names, versions and roles as the layered standard has them; every file is named, once, with its digest."""
    root = etree.fromstring(content[MANIFEST])
    assert root.tag == "fmiReferences"
    assert root.get(LS + "name") == "org.fmi-standard.fmi-ls-ref" and root.get(LS + "version") == "1.0.0-beta.1"
    fixed = "Layered Standard providing information on related files included in an FMU."
    assert root.get(LS + "description") == fixed
    named = {related.get("source"): related for related in root}
    assert len(named) == len(root) and all(related.tag == "Related" for related in root)
    assert {f"{FOLDER}/{source}" for source in named} == {n for n in content if n.startswith(FOLDER)} - {MANIFEST}
    for source, related in named.items():
        assert related.get("role") in ROLES and related.get("type") and related.get("description")
        (checksum,) = related.iterfind(f"Annotations/Annotation[@type='{ls_ref.CHECKSUM}']/Checksum")
        assert checksum.get("checksumType") == "SHA3-256"
        assert checksum.get("checksum") == hashlib.sha3_256(content[f"{FOLDER}/{source}"]).hexdigest()


def test_parameter_sets(content, interface):
    """Valid SSV; the nominal one holds the start values of the geometry, digit for digit."""
    schema = etree.XMLSchema(
        etree.parse(str(Path(fmpy.__file__).parent / "ssp" / "schema" / "SystemStructureParameterValues.xsd"))
    )
    for name in (name for name in content if name.endswith(".ssv")):
        schema.assertValid(etree.fromstring(content[name]))
    nominal = ls_ref._read_parameters(etree.fromstring(content[f"{FOLDER}/nominal.ssv"]))
    assert nominal == {f"geometry.{name}": value for name, value in interface.geometry.items()}


def test_the_fmu_meets_its_own_results(fmu_file, experiments, interface):
    """In fmpy: what any host must reach. Every output is compared, in each experiment."""
    assert [e.name for e in experiments] == ["published_cycle", "other_geometry", "uneven_crank", "with_masses"]
    outputs = {variable.name for variable in interface.of_kind("output")}
    for e in experiments:
        found = fmpy.simulate_fmu(
            str(fmu_file), start_time=e.start, stop_time=e.stop, output_interval=e.step, start_values=e.parameters,
            input=e.inputs, output=list(outputs),
        )  # fmt: skip
        errors = deviations(e, found)
        assert set(errors) == set(e.tolerances) == outputs
        for name, (error, time) in errors.items():
            assert error <= e.tolerances[name], f"{e.name}: {name} at {time} s is off by {error:.2g}"
            if e.name in ("published_cycle", "other_geometry"):  # nothing is predicted wrongly
                assert error <= 2e-12, f"{e.name}: {name} at {time} s is off by {error:.2g}"


@pytest.mark.parametrize("name", ["published_cycle", "other_geometry", "uneven_crank"])
def test_a_late_host_fails(fmu_file, experiments, name):
    """Outputs one step old are far outside every tolerance of the moving tip."""
    (e,) = [e for e in experiments if e.name == name]
    late = e.results.copy()
    for output in ("tip.x", "tip.y"):
        late[output][1:] += (np.diff(e.results[output]) / np.diff(e.results["time"])) * e.step
        assert deviations(e, late)[output][0] > 1e4 * e.tolerances[output]


def test_deviations(experiments):
    e = experiments[0]
    assert all(error == 0 for error, _ in deviations(e, e.results).values())
    changed = e.results.copy()
    changed["tip.y"][7] += 0.25
    changed["crank.tau"][3] = np.nan
    found = deviations(e, changed[::-1])  # in any order
    assert found["tip.y"] == (0.25, e.results["time"][7]) and found["crank.tau"] == (np.inf, e.results["time"][3])
    with pytest.raises(ValueError, match=r"published_cycle: no result at 1 s"):
        deviations(e, e.results[:-1])


def test_no_manifest_is_no_reference(tmp_path, content):
    write_archive(tmp_path / "none.fmu", {"modelDescription.xml": content["modelDescription.xml"]})
    assert read_reference(tmp_path / "none.fmu") == []


def test_times_among_the_attributes(tmp_path, content, experiments):
    """As the draft's text has them, and other tools write them."""
    old = content[f"{FOLDER}/reference.exp"].decode()
    moved = old.replace('">\n    <TransientSimulation startTime', '" startTime').replace('"0.001"/>', '"0.001">')
    moved = moved.replace('"0.002"/>', '"0.002">')
    assert "TransientSimulation" not in moved
    files = content | {f"{FOLDER}/reference.exp": moved.encode(), MANIFEST: without_checksums(content[MANIFEST])}
    write_archive(tmp_path / "other.fmu", files)
    for e, expected in zip(read_reference(tmp_path / "other.fmu"), experiments, strict=True):
        assert (e.start, e.stop, e.step) == (expected.start, expected.stop, expected.step) != (None, None, None)


def without_checksums(manifest: bytes) -> bytes:
    root = etree.fromstring(manifest)
    for related in root:
        related.remove(related.find("Annotations"))
    return etree.tostring(root)


def with_checksums_as_attributes(manifest: bytes, algorithm: str, digest: str) -> bytes:
    """As versions of FMI-LS-REF after 1.0.0-beta.1 have them."""
    root = etree.fromstring(without_checksums(manifest))
    for related in root:
        if related.get("source") == "nominal.ssv":
            related.attrib.update({"checksum": digest, "checksumType": algorithm})
    return etree.tostring(root)


@pytest.mark.parametrize("algorithm", ["SHA3-256", "SHA3-512", "SHA-256", "SHA-512"])
def test_checksums_of_other_writers(tmp_path, content, algorithm, experiments):
    name = algorithm.lower().replace("sha3-", "sha3_").replace("sha-", "sha")
    right = hashlib.new(name, content[f"{FOLDER}/nominal.ssv"]).hexdigest().upper()
    for digest in (right, right[::-1]):
        files = content | {MANIFEST: with_checksums_as_attributes(content[MANIFEST], algorithm, digest)}
        write_archive(tmp_path / "other.fmu", files)
        if digest == right:
            assert len(read_reference(tmp_path / "other.fmu")) == len(experiments)
        else:
            with pytest.raises(UnreadableReference, match=r"nominal\.ssv: changed since"):
                read_reference(tmp_path / "other.fmu")


@pytest.mark.parametrize(
    ("file", "change", "said"),
    [
        ("published_cycle_ref.csv", lambda text: text.replace(b"0.02,", b"0.03,", 1), "changed since the manifest"),
        ("published_cycle_ref.csv", lambda text: None, "not in the archive"),
        ("fmi-ls-manifest.xml", lambda text: text[:200], "fmi-ls-manifest.xml"),
        ("reference.exp", lambda text: text.replace(b"published_cycle_in.csv", b"nowhere.csv"), "changed since"),
    ],
)
def test_what_cannot_be_read(tmp_path, content, file, change, said):
    changed = change(content[f"{FOLDER}/{file}"])
    files = {name: data for name, data in content.items() if name != f"{FOLDER}/{file}"}
    if changed is not None:
        assert changed != content[f"{FOLDER}/{file}"]
        files[f"{FOLDER}/{file}"] = changed
    write_archive(tmp_path / "broken.fmu", files)
    with pytest.raises(UnreadableReference, match=f"{file}.*{said}|{said}"):
        read_reference(tmp_path / "broken.fmu")


def test_a_file_that_is_no_fmu(tmp_path):
    for path in (tmp_path / "missing.fmu", tmp_path):
        with pytest.raises(UnreadableReference, match=path.name):
            read_reference(path)


@pytest.mark.parametrize(
    "text", ["", "time,x\n", "x,time\n1,2\n", "time,x,x\n1,2,3\n", "time,x\n1\n", "time,x\n1,two\n"]
)
def test_tables_that_are_none(text):
    with pytest.raises((ValueError, StopIteration)):
        read_table(text)


def test_experiments_name_what_is_there(interface, monkeypatch, tmp_path):
    """A parameter or unit that the interface has not is refused where the FMU is built."""
    text = (reference.SOURCE / "experiments.toml").read_text(encoding="utf-8")
    monkeypatch.setattr(reference, "SOURCE", tmp_path)
    for old, new in (("geometry.L7", "geometry.L77"), ('"N.m" = 1e-7', '"Nm" = 1e-7')):
        (tmp_path / "experiments.toml").write_text(text.replace(old, new), encoding="utf-8")
        with pytest.raises(ValueError, match=new.partition(" ")[0].strip('"')):
            reference.definitions(interface)


def test_input_times(interface):
    even, _, uneven, _ = reference.definitions(interface)
    assert even.input_times == [0.0, 1.0] and len(uneven.input_times) == 501
    assert uneven.input_times[3] == 0.006 and even.result_times[3] == 0.06, "decimals, not sums"
