"""Whether two versions of the program give the same results, to the last bit, on one machine:

    python -m tests.bench.golden keep FILE.json      what this version makes of every log of `tests.bench.logs`
    python -m tests.bench.golden compare FILE.json   the same now, and what differs from then

Digests of states, sigmas, labels and the verdict of some 200 runs. Another machine, or another version of numpy, may
give other last digits, so the file is not part of the project.
"""

from __future__ import annotations

import hashlib
import json
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from ftproc.core import threads
from ftproc.errors import FtprocError
from tests.bench import logs

PARTS = ("state", "sigma", "label", "verdict")


def digests(name: str) -> dict[str, list[str]]:
    """Of the runs over a log: by name and way, a digest of each part, or the error instead of all of them."""
    found = {}
    for way, settings in logs.ways(name):
        try:
            trajectory, _ = logs.trajectory(name, settings)
        except FtprocError as error:
            found[f"{name}, {way}"] = [str(error)] * len(PARTS)
            continue
        trust = trajectory.metadata["summary"]["trust"]
        parts = (trajectory.state, trajectory.sigma, trajectory.outlier)
        found[f"{name}, {way}"] = [
            *(hashlib.blake2b(np.ascontiguousarray(part).tobytes(), digest_size=8).hexdigest() for part in parts),
            trust["verdict"],
        ]
    return found


def now() -> dict[str, list[str]]:
    """The digests of all runs, in parallel on the processors there are."""
    found: dict[str, list[str]] = {}
    with ProcessPoolExecutor(threads.available(), get_context("spawn"), threads.use, (1,)) as pool:
        for each in pool.map(digests, logs.names()):
            found |= each
    return found


def differences(before: dict[str, list[str]], after: dict[str, list[str]]) -> Iterator[str]:
    """A line for each run that differs, or that only one version has."""
    for run in sorted(before.keys() | after.keys()):
        if run not in before or run not in after:
            yield f"{run}: only {'before' if run in before else 'now'}"
        elif before[run] != after[run]:
            changed = [part for part, a, b in zip(PARTS, before[run], after[run], strict=True) if a != b]
            verdict = f" ({before[run][-1]}, now {after[run][-1]})" if "verdict" in changed else ""
            yield f"{run}: {', '.join(changed)}{verdict}"


def main(what: str, name: str) -> int:
    """Keep or compare; the exit code is 1 where something differs."""
    found = now()
    if what == "keep":
        Path(name).write_text(json.dumps(found, indent=0))
        print(f"{len(found)} runs kept in {name}")
        return 0
    lines = list(differences(json.loads(Path(name).read_text()), found))
    print(*lines, f"{len(lines)} of {len(found)} runs differ", sep="\n")
    return 1 if lines else 0


if __name__ == "__main__":
    if len(sys.argv) != 3 or sys.argv[1] not in ("keep", "compare"):
        sys.exit("usage: python -m tests.bench.golden keep|compare FILE.json")
    sys.exit(main(*sys.argv[1:]))
