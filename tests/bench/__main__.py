"""`python -m tests.bench [NAME...]`: tables of the README and the guide, as Markdown on standard output and in
out/bench.md. The names: samples, accuracy, sigmas, ablation, methods, motions, rivals, instruments, correction,
network, speed, start, scale, live, pages, training."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from itertools import chain
from pathlib import Path

from tests.bench import (
    ablation,
    accuracy,
    correction,
    instruments,
    live,
    methods,
    motions,
    network,
    pages,
    rivals,
    samples,
    scale,
    sigmas,
    speed,
    start,
    training,
)

TABLES = {
    "samples": samples,
    "accuracy": accuracy,
    "sigmas": sigmas,
    "ablation": ablation,
    "methods": methods,
    "motions": motions,
    "rivals": rivals,
    "instruments": instruments,
    "correction": correction,
    "network": network,
    "speed": speed,
    "start": start,
    "scale": scale,
    "live": live,
    "pages": pages,
    "training": training,
}
KEPT = Path("out/bench.md")


def markdown(header: Sequence[str], rows: Iterable[Sequence[str]]) -> Iterable[str]:
    """The lines of a table, as they come."""
    yield "| " + " | ".join(header) + " |"
    yield "|" + " --- |" * len(header)
    for row in rows:
        yield "| " + " | ".join(row) + " |"


def main(names: Sequence[str]) -> None:
    """Print and keep the tables that are named, or all."""
    if unknown := [name for name in names if name not in TABLES]:
        sys.exit(f"there is no table {', '.join(unknown)}; there are {', '.join(TABLES)}")
    KEPT.parent.mkdir(exist_ok=True)
    with KEPT.open("w", encoding="utf-8") as kept:
        for name in names or TABLES:
            table = TABLES[name]
            for line in chain([f"\n{table.__doc__}\n"], markdown(table.HEADER, table.rows())):
                print(line, file=kept, flush=True)
                print(line, flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
