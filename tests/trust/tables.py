"""What the tables of hard faults share: their command line, the processes, and when a run is wrong."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any, NamedTuple

from ftproc.core import threads
from ftproc.quality.verdict import CONSISTENT


class Given(NamedTuple):
    """Of the command line: seeds, names of classes, number of processes, and whether to print each run."""

    seeds: range
    names: list[str]
    processes: int
    verbose: bool


def arguments(about: str | None, names: Iterable[str]) -> Given:
    """SEEDS [NAME...] [-j N] [-v]. No name: all of them."""
    known = list(names)
    parser = argparse.ArgumentParser(description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("seeds", metavar="FIRST-LAST")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(known)}")
    parser.add_argument("-j", "--processes", type=int, default=threads.available())
    parser.add_argument("-v", "--verbose", action="store_true", help="a line for each run")
    given = parser.parse_intermixed_args()
    first, last = (int(word) for word in given.seeds.split("-"))
    if unknown := [name for name in given.names if name not in known]:
        parser.error(f"there is no {', '.join(unknown)}; there are {', '.join(known)}")
    return Given(range(first, last + 1), given.names or known, given.processes, given.verbose)


def spread(run: Callable[..., list[Any]], jobs: list[tuple[Any, ...]], given: Given) -> Iterator[Any]:
    """The runs of all jobs, in their order; each is printed where that is wished."""
    with ProcessPoolExecutor(given.processes, get_context("spawn"), threads.use, (1,)) as pool:
        for found in pool.map(run, *zip(*jobs, strict=True)):
            for each in found:
                if given.verbose:
                    print(each, flush=True)
                yield each


def show(header: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> None:
    """Print a table."""
    for cells in (header, *rows):
        print(*cells, sep=" | ")


def mark(wrong: bool, verdict: str) -> str:
    """One word for a run."""
    return "right" if not wrong else "CONFIDENT" if verdict == CONSISTENT else "wrong"
