"""The entry of the command `linkage-fmu`, and of `python -m transplanter_linkage`."""

from __future__ import annotations

import sys


def main() -> int:
    try:
        from .exporter.cli import main as command

        return command()
    except ModuleNotFoundError as missing:  # installed with --no-deps: fmu() needs no other package, the command does
        print(f"linkage-fmu: {missing}: install the wheel with what it depends on, without --no-deps", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
