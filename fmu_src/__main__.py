"""The entry of the command `linkage-fmu`, and of `python -m transplanter_linkage`."""

from __future__ import annotations

import signal
import sys


def main() -> int:
    try:
        from .cli import main as command

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
