"""What the tables of faults share: their command line, the processes, and the bounds of a class."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any, NamedTuple, Protocol

from ftproc.core import threads


class Judged(Protocol):
    """A run. wrong: beyond its sigmas. confident: wrong and called consistent. reported: not called consistent."""

    @property
    def wrong(self) -> bool: ...
    @property
    def confident(self) -> bool: ...
    @property
    def reported(self) -> bool: ...


class Bound(NamedTuple):
    """The largest shares of the runs of a class."""

    wrong: float = 1.0
    confident: float = 1.0
    reported: float = 1.0


def beyond(name: str, found: Sequence[Judged], bound: Bound) -> Iterator[str]:
    """The bounds that the runs of a class break."""
    for what, share in bound._asdict().items():
        count = sum(getattr(run, what) for run in found)
        if count > share * len(found):
            yield f"{name}: {count} of {len(found)} runs are {what}, at most {100 * share:g} % may be"


def counts(found: Sequence[Judged]) -> str:
    """Runs, reported, wrong, confident and wrong."""
    return ", ".join(
        str(sum(each)) for each in zip(*((1, r.reported, r.wrong, r.confident) for r in found), strict=True)
    )


class Counted(NamedTuple):
    """Rows of a table, what and how many, and a line for each thing that is wrong."""

    rows: Sequence[tuple[str, object]]
    failures: Sequence[str]


class Given(NamedTuple):
    """Of the command line: seeds, names of classes, number of processes, and whether to print each run."""

    seeds: range
    names: Sequence[str]
    processes: int = threads.available()
    verbose: bool = False

    @property
    def jobs(self) -> list[tuple[str, int]]:
        """Class and seed of each log, class by class."""
        return [(name, seed) for name in self.names for seed in self.seeds]


def arguments(about: str | None, names: Iterable[str]) -> Given:
    """FIRST-LAST [NAME...] [-j N] [-v]. No name: all of them."""
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


def spread(run: Callable[..., list[Any]], jobs: Sequence[tuple[Any, ...]], given: Given) -> Iterator[Any]:
    """The runs of all jobs, in their order; each is printed where that is wished."""
    with ProcessPoolExecutor(given.processes, get_context("spawn"), threads.use, (1,)) as pool:
        for found in pool.map(run, *zip(*jobs, strict=True)):
            for each in found:
                if given.verbose:
                    print(each, flush=True)
                yield each


def show(header: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> None:
    """Print a table in Markdown."""
    for cells in (header, ("---",) * len(header), *rows):
        print(f"| {' | '.join(cells)} |")


def mark(run: Judged) -> str:
    """One word for a run."""
    return "CONFIDENT" if run.confident else "wrong" if run.wrong else "right"
