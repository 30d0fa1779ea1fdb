"""Goes on from a serialized state in a process of its own.

python -m tests.harness.replay FMU-FOLDER CALLBACKS STATE FIRST LAST VERSION
"""

from __future__ import annotations

import sys
from pathlib import Path

from tests.harness.host import Fmu
from tests.harness.host3 import Fmu3
from tests.harness.life import tell


def main(folder: str, callbacks: str, state: str, first: str, last: str, version: str) -> None:
    fmu = {"2": Fmu, "3": Fmu3}[version](Path(folder), Path(folder), Path(callbacks))
    with fmu.instance("in another process") as instance:
        instance.deserialize(Path(state).read_bytes())
        print("\n".join(tell(instance, int(first), int(last))))
        Path(state).write_bytes(instance.serialize())


if __name__ == "__main__":
    main(*sys.argv[1:])
