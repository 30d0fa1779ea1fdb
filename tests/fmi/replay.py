"""Goes on from a serialized state in a process of its own.

python -m tests.fmi.replay FMU-FOLDER CALLBACKS STATE FIRST LAST
"""

from __future__ import annotations

import sys
from pathlib import Path

from tests.fmi.host import Fmu, Instance
from tests.fmi.life import tell


def main(folder: str, callbacks: str, state: str, first: str, last: str) -> None:
    fmu = Fmu(Path(folder), Path(folder), Path(callbacks))
    with Instance(fmu, "in another process") as instance:
        instance.deserialize(Path(state).read_bytes())
        print("\n".join(tell(instance, int(first), int(last))))
        Path(state).write_bytes(instance.serialize())


if __name__ == "__main__":
    main(*sys.argv[1:])
