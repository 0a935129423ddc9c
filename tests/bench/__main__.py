"""`python -m tests.bench [accuracy] [methods] [correction] [speed]`: the tables of the README, as Markdown."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence

from tests.bench import accuracy, correction, methods, speed

TABLES = {"accuracy": accuracy, "methods": methods, "correction": correction, "speed": speed}


def markdown(header: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Print a table as it comes."""
    print("| " + " | ".join(header) + " |")
    print("|" + " --- |" * len(header))
    for row in rows:
        print("| " + " | ".join(row) + " |", flush=True)


def main() -> None:
    """Print the tables that are named, or all."""
    for name in sys.argv[1:] or TABLES:
        print(f"\n{TABLES[name].__doc__}\n")
        markdown(TABLES[name].HEADER, TABLES[name].rows())


if __name__ == "__main__":
    main()
