"""`make hosts`: builds the FMUs, runs them in hosts and checkers that others wrote, and on other platforms; with --host
in those alone.

First it says all that it will do. Ends with 1 where something disagrees.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

from fmu_src.cli import main as linkage_fmu
from tests.hosts import foreign_platforms, table


class NotBuilt(Exception):
    """The FMUs could not be built; why has been said."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Options are those of table.py."""
    arguments = sys.argv[1:] if arguments is None else arguments
    is_all = not arguments

    def first() -> None:
        if is_all:
            foreign_platforms.plan()
        if linkage_fmu(["build"]) != 0:
            raise NotBuilt

    try:
        status = table.main(list(arguments), first)
    except NotBuilt:
        return 1
    return max(status, foreign_platforms.main()) if is_all else status


if __name__ == "__main__":
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit("hosts: interrupted; what was built stays in build/hosts")
