"""What `linkage-fmu validate` makes of FMUs that misbehave as hostile.h has it.

    python -m tests.validation.hostile [LIMIT]

prints for each: what was said of it, and the time that its check took beyond the limit of one run; and the time that
archives of many entries take, which must grow as their number.
"""

from __future__ import annotations

import os
import re
import sys
import tempfile
from contextlib import suppress
from pathlib import Path

import psutil

from fmu_src.validation.subject import Options
from fmu_src.validation.table import NAMES, NAMES_OF_LIVE, Result, validate
from tests.validation import small_fmu

MARK = "LINKAGE_FMU_HOSTILE"  # environment variable by which what is left running is known
# How it misbehaves to what must be said of the run; an empty text: nothing, it passes.
SAID = {
    "prints": "no answer within",
    "prints-one-line": "no answer within",
    "prints-controls": "exit status 0x3",
    "forks-crashes": "died of SIGSEGV in fmi2DoStep",
    "forks-hangs": "no answer within",
    "daemon": "",
    "daemon-crashes": "died of SIGSEGV in fmi2DoStep",
    "hopper-crashes": "died of SIGSEGV in fmi2DoStep",
    "stops": "no answer within",
    "stops-group": "no answer within",
    "closes": "closed files of the process",
    "closes-stops": "closed files of the process",
    "closes-forks-stops": "closed files of the process",
    "exits": "the FMU ended the process, exit status 0x0",
    "crashes": "died of SIGSEGV in fmi2DoStep",
    "sleeps": "s in fmi2DoStep",
    "deaf": "no answer within",
    "spins": "s in fmi2DoStep",
    "allocates": "of memory: more than the 0.5 GiB that it may",
    "kills-parent": "died of SIGKILL",
    "kills-parent-stops": "died of SIGKILL",
    "kills-parent-daemon": "died of SIGKILL",
    "stops-parent": "no answer within",
    "interrupts": "died of SIGINT",
    "reads": "",
    "answers": "wrote into the pipe for answers",
    "answers-brackets": "wrote into the pipe for answers",
    "shares": "",
    "litters": "",
    "deepens": "",
}


def write(path: Path, how: str) -> Path:
    """An FMU of FMI 2.0 for co-simulation alone."""
    files = small_fmu.content("2.0", how)
    xml = re.sub(rb"<ModelExchange.*?/>", b"", files["modelDescription.xml"], flags=re.DOTALL)
    return small_fmu.write(path, files | {"modelDescription.xml": xml})


def judge(path: Path, limit: float) -> dict[str, Result]:
    options = Options(limit=limit, memory=2.0**29, skip=frozenset(NAMES) - {"load", "instance", "run", "processes"})
    return {result.title: result for result in validate(path, options)}


def left_running() -> list[psutil.Process]:
    """Processes with this one's mark, other than it."""
    found = []
    for process in psutil.process_iter():
        with suppress(psutil.Error):
            is_marked = process.environ().get(MARK) == os.environ[MARK]
            if process.pid != os.getpid() and is_marked and process.status() != psutil.STATUS_ZOMBIE:
                found.append(process)
    return found


def main(limit: float) -> None:
    os.environ[MARK] = str(os.getpid())
    with tempfile.TemporaryDirectory() as folder:
        tempfile.tempdir = folder
        for how in SAID:
            run = judge(write(Path(folder) / "Hostile.fmu", how), limit)["run (CS)"]
            (Path(folder) / "Hostile.fmu").unlink()
            left = [*left_running(), *Path(folder).iterdir()]
            said = "; ".join(run.problems) or run.outcome
            print(f"{how:20} {run.seconds - limit:+6.2f} s  {said[:90]}{'  LEFT: ' if left else ''}{left or ''}")
        for count in (10_000, 20_000, 40_000):
            seconds = seconds_of_entries(Path(folder) / "Many.fmu", count)
            print(f"{count} entries: {seconds:.1f} s, {1e6 * seconds / count:.0f} us each")


def seconds_of_entries(path: Path, count: int) -> float:
    """What the checks of files take for an FMU with that many more files."""
    files = {f"resources/{number}.txt": b"" for number in range(count)}
    small_fmu.write(path, small_fmu.content("2.0") | files)
    results = validate(path, Options(skip=frozenset(NAMES_OF_LIVE)))
    return sum(result.seconds for result in results)


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 2.0)
