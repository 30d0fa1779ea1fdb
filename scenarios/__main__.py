"""The published planting cycle and the field row, side by side: what `make run` runs.

    python -m scenarios

The row's processes plant while this one runs the cycle. To choose anything, run `python -m scenarios.paper_cycle` or
`python -m scenarios.field_row`.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line; returns the exit status."""
    argparse.ArgumentParser(prog="python -m scenarios", description=__doc__.splitlines()[0]).parse_args(arguments)
    from scenarios.field_row import __main__ as field_row  # not above: the row's processes import this file

    return field_row.main([], meanwhile=_cycle)


def _cycle() -> None:
    """Where the cycle fails, the row is given up."""
    from scenarios.paper_cycle import __main__ as paper_cycle

    if status := paper_cycle.main([]):
        sys.exit(status)


if __name__ == "__main__":
    sys.exit(main())
