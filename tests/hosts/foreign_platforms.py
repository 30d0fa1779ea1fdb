"""The binaries for other platforms run, not just compiled: `python -m tests.hosts.foreign_platforms`, the end of
`make hosts`.

A small C host (platform_bits.c), compiled like the FMU for each platform, drives the binary through a fixed sequence
of calls and prints every answer to the last bit: natively, under wine (Debian: wine64) for Windows, under qemu
(Debian: qemu-user-static or qemu-user, and libc6-arm64-cross for the C library) for Linux on aarch64. macOS has no
such program; its binaries are compiled and looked into, not run.
"""

from __future__ import annotations

import os
import shutil
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from fmu_src.exporter.build import build_fmu
from fmu_src.exporter.compiler import PLATFORMS, Platform, compile_program, host_platform
from fmu_src.interface import load_interface
from scenarios.common import reports
from scenarios.common.reports import markdown_table

ROOT = Path(__file__).resolve().parents[2]
SOURCE = Path(__file__).with_name("platform_bits.c")
TIME_LIMIT = 300  # s
AARCH64_ROOT = Path("/usr/aarch64-linux-gnu")
WINE = ("wine64", "/usr/lib/wine/wine64", "wine")
WINE_PREFIX = ROOT / "build" / "hosts" / "wine"  # takes wine 10 s to make
QEMU = ("qemu-aarch64-static", "qemu-aarch64")
ALIKE = "to the bit"
HEADINGS = ("FMI", "platform", "run by", "answers", "numbers", "different", "worst", "s")


class CannotRun(RuntimeError):
    """The machine lacks what runs the platform's programs; the message names it."""


@dataclass(frozen=True)
class Difference:
    """Two platforms' answers: how many numbers, how many of them differ, the worst difference in units in the last
    place, and the first line that is not the same, of each (None where all are).
    """

    lines: int
    numbers: int
    different: int
    ulps: int
    first: tuple[str, str] | None


def runner(target: Platform) -> list[str]:
    """The words before the program on the command line; raises CannotRun."""
    if target == host_platform():
        return []
    if target.suffix == ".dll":
        return [first_program(WINE, "wine (Debian wine64)")]
    if target.name == "aarch64-linux":
        command = [first_program(QEMU, "qemu (Debian qemu-user-static)"), "-L", str(AARCH64_ROOT)]
        if not (AARCH64_ROOT / "lib" / "ld-linux-aarch64.so.1").exists():
            raise CannotRun("a C library for aarch64 (Debian libc6-arm64-cross)")
        return command
    raise CannotRun(f"a way to run programs of {target.name}")


def first_program(names: Sequence[str], what: str) -> str:
    found = next(filter(None, map(shutil.which, names)), None)
    if found is None:
        raise CannotRun(what)
    return found


def answers(version: int, library: Path, target: Platform, folder: Path) -> list[str]:
    """The lines that the C host prints for a binary; raises CannotRun, and RuntimeError where it fails."""
    command = runner(target)
    program = folder / f"platform_bits{version}-{target.name}{'.exe' if target.suffix == '.dll' else ''}"
    # -s as the FMU has it: else zig builds the C library of Windows a second time, a minute with a cold cache
    options = ("-I", str(ROOT), f"-DFMI={version}", "-s", *(() if target.suffix == ".dll" else ("-ldl",)))
    compile_program((SOURCE,), program, target, *options)
    WINE_PREFIX.parent.mkdir(parents=True, exist_ok=True)
    command += [str(program), str(library), load_interface().token]
    wine = {"WINEPREFIX": str(WINE_PREFIX), "WINEDEBUG": "-all", "WINEDLLOVERRIDES": "mscoree,mshtml="}
    environment = {**os.environ, **wine}
    # files, not pipes: wine's server holds these open for seconds after the program
    told, complaints = (folder / f"{program.stem}.{kind}.txt" for kind in ("answers", "errors"))
    with told.open("wb") as out, complaints.open("wb") as err:
        done = subprocess.run(command, stdout=out, stderr=err, timeout=TIME_LIMIT, env=environment, cwd=folder)
    lines = told.read_text(errors="replace").splitlines()
    if done.returncode != 0 or lines[-1:] != ["done"]:
        said = complaints.read_text(errors="replace").strip() or " ".join(lines[-1:])
        raise RuntimeError(f"{target.name}: ended with {done.returncode}: {said[-500:]}")
    return lines


def compare(ours: Sequence[str], theirs: Sequence[str]) -> Difference:
    """Line by line, number by number."""
    numbers = different = worst = 0
    first = next(((a, b) for a, b in zip(ours, theirs, strict=False) if a != b), None)
    if first is None and len(ours) != len(theirs):
        first = (f"{len(ours)} lines", f"{len(theirs)} lines")
    for a, b in zip(ours, theirs, strict=False):
        if a.startswith(("message", "state")):
            continue
        for left, right in zip(a.split(), b.split(), strict=False):
            if len(left) == len(right) == 16:
                numbers += 1
                different += left != right
                worst = max(worst, abs(ordered(left) - ordered(right)))
    return Difference(min(len(ours), len(theirs)), numbers, different, worst, first)


def ordered(digits: str) -> int:
    """A double as an integer that grows with it, one a unit in the last place."""
    (bits,) = struct.unpack(">q", bytes.fromhex(digits))
    return bits if bits >= 0 else -(bits & 0x7FFFFFFFFFFFFFFF)


def runnable() -> tuple[list[Platform], list[str]]:
    """The platforms whose programs this machine can run, and a line for each that it cannot."""
    targets, lacks = [], []
    for target in PLATFORMS.values():
        if target.suffix == ".dylib" and target != host_platform():
            continue  # nowhere
        try:
            runner(target)
        except CannotRun as lack:
            lacks.append(f"skipped: {target.name}: this machine lacks {lack}")
        else:
            targets.append(target)
    return targets, lacks


def unpack_all(version: int, targets: Sequence[Platform], folder: Path) -> dict[str, Path]:
    """The FMU's binaries for these platforms, by the platform's name."""
    shutil.unpack_archive(build_fmu(version, folder / "fmu", targets), folder / f"unpacked{version}", "zip")
    files: dict[str, Path] = {}
    for target in targets:  # FMI 2.0 has one folder for both processors of a system
        places = (folder / f"unpacked{version}" / "binaries" / name for name in (target.folder, target.other_folder))
        found = (file for place in places for file in place.glob(f"*{target.suffix}"))
        files[target.name] = next(file for file in found if file not in files.values())
    return files


def compare_platforms(
    version: int, targets: Sequence[Platform], folder: Path
) -> tuple[list[tuple[str, ...]], list[str]]:
    """The rows under HEADINGS for one FMI version, and what is to be said besides."""
    rows, notes = [], []
    libraries = unpack_all(version, targets, folder)
    native = answers(version, libraries[host_platform().name], host_platform(), folder)
    for platform, library in libraries.items():
        target, who, begin = PLATFORMS[platform], f"FMI {version}.0, {platform}", time.perf_counter()
        print(who, flush=True)
        found = compare(native, answers(version, library, target, folder))
        seconds = f"{time.perf_counter() - begin:.1f}"
        by = Path((runner(target) or ["itself, again"])[0]).name
        numbers = (f"{number:,}" for number in (found.lines, found.numbers, found.different))
        worst = ALIKE if found.first is None else f"{found.ulps} ulp" if found.different else "said otherwise"
        rows.append((f"{version}.0", platform, by, *numbers, worst, seconds))
        if found.first is not None:
            notes.append(f"{who}: {found.first[1]}\nwhere natively: {found.first[0]}")
    return rows, notes


def main() -> int:
    """0 where all platforms that could be run answer alike; else 1."""
    (targets, lacks), console, rows, notes = runnable(), reports.console(), [], []
    print(f"compiling for {', '.join(target.name for target in targets)}", flush=True)
    with tempfile.TemporaryDirectory() as name:
        for version in (2, 3):
            for all_, more in zip((rows, notes), compare_platforms(version, targets, Path(name)), strict=True):
                all_.extend(more)
    reports.show_table(console, "", HEADINGS, rows, words=HEADINGS[:4])
    for line in notes:
        console.print(line, highlight=False, markup=False)
    output = Path("build/reports/hosts")
    output.mkdir(parents=True, exist_ok=True)
    text = ["# The FMU's binaries for other platforms", markdown_table(HEADINGS, rows).rstrip(), *notes, *lacks]
    (output / "platforms.md").write_text("\n\n".join(text) + "\n", encoding="utf-8")
    print(f"written to {output}/")
    return any(ALIKE not in row for row in rows)


def plan() -> None:
    """Say what main() will do: which platforms it compiles for and runs, and which it cannot."""
    targets, lacks = runnable()
    names = ", ".join(target.name for target in targets)
    print(f"platforms: {names}: compiled, minutes the first time, and run", *lacks, sep="\n", flush=True)


if __name__ == "__main__":
    plan()
    sys.exit(main())
