"""What the host's process may be like: another decimal sign, rounding mode, denormals off, exceptions unmasked.

The C hosts are decimal_sign.c and environment.c; the latter sets the control word of x86-64 processors
through GNU's functions, and is left out elsewhere.
"""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Iterable
from pathlib import Path

from scenarios.common.command import ROOT
from scenarios.common.instance import UnpackedFmu
from scenarios.speed_vs_error.hard_cases.measured import Measured, Worst
from scenarios.speed_vs_error.yardstick import compile_program, host_platform

HERE = Path(__file__).parent
SIGNS = (",", "\N{ARABIC DECIMAL SEPARATOR}")
# As direction.h states it for the other rounding modes.
ROUNDED_OTHERWISE = 1e-9
EXACTLY = "round to nearest, again", "denormals to zero", "exceptions unmasked"


def measure(fmu: UnpackedFmu) -> list[Measured]:
    if host_platform().name != "x86_64-linux":
        return []
    with tempfile.TemporaryDirectory() as folder:
        return [*decimal_sign(fmu, Path(folder)), *environment(fmu, Path(folder))]


def run(name: str, fmu: UnpackedFmu, folder: Path, *arguments: str) -> str:
    """What a C host prints; RuntimeError with what it complains of."""
    program = folder / name
    if not program.exists():
        compile_program((HERE / f"{name}.c",), program, host_platform(), "-I", str(ROOT), "-rdynamic", "-ldl")
    done = subprocess.run([program, fmu.library, fmu.guid, *arguments], capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"{name}: {done.returncode}: {done.stderr}")
    return done.stdout


def decimal_sign(fmu: UnpackedFmu, folder: Path) -> Iterable[Measured]:
    texts = {sign: run("decimal_sign", fmu, folder, sign) for sign in (".", *SIGNS)}
    other = sum(texts[sign] != texts["."] or "12.625" not in texts[sign] for sign in SIGNS)
    yield Measured(
        "a locale with another decimal sign",
        "messages whose numbers are not written with a point",
        "messages",
        other,
        0,
    )


def environment(fmu: UnpackedFmu, folder: Path) -> Iterable[Measured]:
    rounding, exact, changes, struck = Worst(), Worst(), Worst(), Worst()
    for line in run("environment", fmu, folder).splitlines():
        name, deviation, changed, victim = line.split(";")
        (exact if name in EXACTLY else rounding).see(float(deviation), name)
        changes.see(int(changed), name)
        if victim != "nothing":
            struck.see(struck.value + 1, f"{name}: {victim}")
    yield Measured(
        "rounding upward, downward, toward zero",
        "deviation of any output from round to nearest",
        "of the output's greatest value",
        rounding.value,
        ROUNDED_OTHERWISE,
        rounding.where,
    )
    yield Measured(
        "denormals flushed to zero; exceptions unmasked",
        "deviation of any output",
        "of the output's greatest value",
        exact.value,
        0,
        exact.where,
    )
    yield Measured(
        "rounding mode, denormals, exception masks",
        "calls after which they are not the host's",
        "calls",
        changes.value,
        0,
        changes.where,
    )
    yield Measured(
        "invalid, divide by zero, overflow unmasked",
        "stories that end in one: rest, start, jump, wrap, standstill, dead points, derivatives, states",
        "stories",
        struck.value,
        0,
        struck.where,
    )
