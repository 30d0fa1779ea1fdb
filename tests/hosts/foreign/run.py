"""One host's run, or a checker's, in a process of its own, for hosts may crash and bring libraries that clash:

    python -m tests.hosts.foreign.run play RESULT HOST FMU EDITION INTERFACE
    python -m tests.hosts.foreign.run check RESULT CHECKER FMU
    python -m tests.hosts.foreign.run prepare RESULT NAME

RESULT is written as JSON: of each drive, or of the checker as a whole, the seconds (without what is prepared once)
and `found`: rows of [time, *OUTPUTS], or what the checker reported. A drive that fails has `failed`, in words.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from tests.hosts.drives import DRIVES, Drive
from tests.hosts.foreign import HostError, Task, load


def main(verb: str, result: str, name: str, fmu: str = "", *which: str) -> int:
    module, file = load(name), Path(fmu).resolve()

    def play(drive: Drive) -> list[list[float]]:
        with tempfile.TemporaryDirectory() as folder:
            rows = module.play(Task(file, *which, drive, Path(folder)))
            return [[float(time_), *map(float, values)] for time_, values in rows]

    if verb == "play":
        answer = {key: timed(lambda drive=drive: play(drive)) for key, drive in DRIVES.items()}
    elif verb == "check":
        answer = timed(lambda: module.check(file))
    else:
        answer = timed(lambda: module.prepare() or [])
    Path(result).write_text(json.dumps(answer))
    return 0


def timed(work: Callable[[], list]) -> dict:
    begin = time.perf_counter()
    try:
        answer = {"found": work()}
    except HostError as problem:
        answer = {"failed": str(problem)}
    except Exception as problem:  # noqa: BLE001 - whatever a foreign host raises
        answer = {"failed": f"{type(problem).__name__}: {problem}"}
    return {"seconds": time.perf_counter() - begin, **answer}


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
