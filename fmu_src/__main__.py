"""The entry of the command `linkage-fmu`, and of `python -m transplanter_linkage`."""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path


def main() -> int:
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:  # closed by the caller: what is opened next would be taken for it
            setattr(sys, name, Path(os.devnull).open(mode))  # noqa: SIM115 as long as the process is
    handler = signal.getsignal(signal.SIGINT)
    if handler is signal.default_int_handler:  # some packages abort where an exception ends their loading
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        from .cli import main as command

        signal.signal(signal.SIGINT, handler)
        return command()
    except (
        ImportError
    ) as missing:  # broken, or installed with --no-deps: fmu() needs no other package, the command does
        print(f"linkage-fmu: {missing}: install the wheel with what it depends on, without --no-deps", file=sys.stderr)
        return 2
    except KeyboardInterrupt:  # while packages were loaded
        return 128 + signal.SIGINT


if __name__ == "__main__":
    sys.exit(main())
