"""The experiment of Shao et al. 2020 (REnPF): GPS-aided alignment of a strapdown system on the move, 600 s, 30 runs
without outliers (the paper's simulation one) and 15 with outliers (its simulation two, of which it shows one run).
"""

from __future__ import annotations

import multiprocessing
import os
import time
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from functools import partial

import numpy as np
from numpy.random import Generator
from scipy.special import chdtrc

from ftproc.core.comparators import particles
from ftproc.core.comparators.ensemble import Analysis, Forecast, enkf
from tests.acceptance.reproduce import alignment_plots as plots
from tests.acceptance.reproduce.aligning import OUTLIER_TIMES_S, Run, Update, align
from tests.acceptance.reproduce.drive import drive
from tests.acceptance.reproduce.page import Page, conclusions

RUNS, SPOILED_RUNS = 30, 15
OFF_DEGREES = 15.0  # half the first heading error: an attitude further off is not aligned
PAPER_MEMBERS, ENOUGH_MEMBERS = 20, 100  # the paper's, and enough for the covariance of 15 errors
PAPER_GATE = 6.626  # the paper's: the 75 % point of chi-square with 5 degrees of freedom, for readings of 6
PAPER = {  # its table 6: pitch, roll, heading in degrees at 600 s, one run
    "enpf": (0.1673, -0.1921, 1.0151),
    "enpf-chi2": (-0.0838, 0.0629, 0.5363),
    "renpf": (-0.0608, 0.0221, 0.3097),
}


def enkf_gated(known: Forecast, rng: Generator) -> Analysis:
    """The ensemble Kalman filter behind the paper's gate: what is left of `enpf-chi2` without its particles."""
    return Analysis(known.members, known.mean, 0.0) if known.rho > PAPER_GATE else enkf(known, rng)


FILTERS: dict[str, Update] = {
    **particles.UPDATES,
    "enkf-chi2": enkf_gated,
    "enpf-chi2": partial(particles.enpf_gated, gate=1 - chdtrc(6, PAPER_GATE)),
}

Case = tuple[str, int, bool]  # filter, members, outliers
ORDER = 3
Runs = dict[Case, list[Run]]


def section(page: Page) -> str:
    """Do the experiment with every core; writes the plots and returns the section in Markdown."""
    began = time.monotonic()
    cases = [(name, n, bad) for bad in (False, True) for n in (PAPER_MEMBERS, ENOUGH_MEMBERS) for name in FILTERS]
    runs = all_runs([(case, seed) for case in cases for seed in range(SPOILED_RUNS if case[2] else RUNS)])
    plots.draw(page.directory, runs, ENOUGH_MEMBERS, PAPER_GATE)
    return report(runs, time.monotonic() - began)


def all_runs(jobs: list[tuple[Case, int]]) -> Runs:
    """The runs of these cases and seeds, in as many processes as there are cores."""
    threads = os.environ.get("OPENBLAS_NUM_THREADS")
    os.environ["OPENBLAS_NUM_THREADS"] = "1"  # the matrices are small, and every core has a process of its own
    try:
        context = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(os.cpu_count() or 1, mp_context=context) as pool:
            done = list(pool.map(one_run, jobs, chunksize=10))
    finally:
        if threads is None:
            del os.environ["OPENBLAS_NUM_THREADS"]
        else:
            os.environ["OPENBLAS_NUM_THREADS"] = threads
    runs: Runs = {case: [] for case, _ in jobs}
    for (case, _), run in zip(jobs, done, strict=True):
        runs[case].append(run)
    return runs


def one_run(job: tuple[Case, int]) -> Run:
    """The run of a case with a seed."""
    (name, members, outliers), seed = job
    return align(drive(), FILTERS[name], members, seed, outliers)


def final(runs: list[Run]) -> np.ndarray:
    """(runs, 3) error of pitch, roll, heading in degrees at the end."""
    return np.array([run.attitude[-1] for run in runs])


def astray(runs: list[Run]) -> str:
    """How many runs are not aligned after 100 s, and how many at the end."""
    return ", ".join(str(sum(np.abs(r.attitude[k]).max() > OFF_DEGREES for r in runs)) for k in (99, -1))


def jump(runs: list[Run]) -> float:
    """By how many degrees the outliers move the attitude, on average over runs and outliers; the largest angle's."""
    rows = np.array(OUTLIER_TIMES_S) - 1
    return float(np.mean([np.abs(r.attitude[rows] - r.attitude[rows - 1]).max(1).mean() for r in runs]))


def _three(values: Iterable[float]) -> str:
    return " / ".join(f"{v:.3f}" for v in values)


def _table(header: list[str], rows: Iterable[list[str]]) -> str:
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def report(runs: Runs, seconds: float) -> str:
    """The section: three tables and what they say."""

    def row(name: str, n: int, bad: bool, *more: Callable[[list[Run]], str]) -> list[str]:
        of = runs[name, n, bad]
        return [name, str(n), _three(np.median(np.abs(final(of)), 0)), astray(of), *(cell(of) for cell in more)]

    members = sorted({n for _, n, _ in runs})
    names = list(FILTERS)
    errors = "median size of the error at 600 s, pitch / roll / heading, degrees"
    off = f"runs off by more than {OFF_DEGREES:.0f} degrees at 100 s, 600 s"

    def mean(of: list[Run]) -> str:
        return _three(final(of).mean(0))

    def used(of: list[Run]) -> str:
        return f"{100 * np.mean([r.gamma > 0 for r in of]):.0f}"

    def moved(of: list[Run]) -> str:
        return f"{jump(of):.3f}"

    clean = _table(
        ["filter", "members", errors, off, "mean error", "readings used %"],
        [row(name, n, False, mean, used) for n in members for name in names],
    )
    spoiled = _table(
        ["filter", "members", errors, off, "moved by an outlier", "paper's table 6, its one run"],
        [
            [*row(name, n, True, moved), _three(PAPER[name]) if name in PAPER else "-"]
            for n in members
            for name in names
        ],
    )
    speed = _table(
        ["filter", *(f"{n} members, ms per epoch" for n in members)],
        [
            [name, *(f"{1e3 * np.median([r.seconds for r in runs[name, n, False]]):.2f}" for n in members)]
            for name in names
        ],
    )
    return TEXT.format(
        count=RUNS,
        spoiled_count=SPOILED_RUNS,
        clean=clean,
        spoiled=spoiled,
        speed=speed,
        seconds=seconds,
        gate=PAPER_GATE,
        few=PAPER_MEMBERS,
        claims=conclusions(claims(runs)),
    )


def claims(runs: Runs) -> list[tuple[str, str, bool]]:
    """(claim of the paper, what came out here, whether it holds); of heading errors in degrees, medians over runs."""
    few, enough = PAPER_MEMBERS, ENOUGH_MEMBERS

    def heading(name: str, members: int, bad: bool = False) -> float:
        return float(np.median(np.abs(final(runs[name, members, bad])[:, 2])))

    def both(name: str, bad: bool = False) -> str:
        return (
            f"{name} {heading(name, few, bad):.3f} with {few} members, {heading(name, enough, bad):.3f} with {enough}"
        )

    lost = {
        n: sum(int(np.abs(r.attitude[-1]).max() > OFF_DEGREES) for r in runs["renpf", n, False]) for n in (few, enough)
    }
    moved = {name: jump(runs[name, enough, True]) for name in ("enpf", "enpf-chi2", "renpf")}
    refused = np.mean([np.mean([r.gamma[k - 1] == 0 for k in OUTLIER_TIMES_S]) for r in runs["renpf", enough, True]])
    cost = {name: np.median([r.seconds for r in runs[name, enough, False]]) for name in ("enkf", "enpf", "renpf")}
    gated, control = "enpf-chi2", "enkf-chi2"
    return [
        ("REnPF aligns from 30 degrees",
         f"{lost[few]} and {lost[enough]} of {len(runs['renpf', few, False])} runs lost, {few} and {enough} members",
         lost[few] == lost[enough] == 0),
        ("without outliers EnPF is better than EnKF", f"{both('enkf')}; {both('enpf')}",
         all(heading("enpf", n) < heading("enkf", n) for n in (few, enough))),
        ("and REnPF better than both", both("renpf"),
         all(heading("renpf", n) < min(heading("enkf", n), heading("enpf", n)) for n in (few, enough))),
        ("outliers throw EnPF about", f"moved by {moved['enpf']:.2f} degrees, REnPF by {moved['renpf']:.2f}",
         moved["enpf"] > 3 * moved["renpf"]),
        (f"a chi-square gate of {PAPER_GATE} lessens that", f"moved by {moved[gated]:.2f} degrees ({enough} members)",
         moved[gated] < moved["enpf"]),
        ("EnPF behind it ends at 0.54 degrees", both(gated, True), heading(gated, few, True) < 2 * PAPER[gated][2]),
        ("... and that it does not is the particles' doing", f"without them: {both(control, True)}",
         heading(gated, few, True) > 3 * heading(control, few, True)),
        ("REnPF refuses the outliers", f"{100 * refused:.0f} % of them", bool(refused == 1)),
        ("REnPF ends nearest of the three with outliers", both("renpf", True),
         all(heading("renpf", n, True) < heading(name, n, True) for n in (few, enough) for name in ("enpf", gated))),
        ("REnPF costs far more", f"{cost['renpf'] / cost['enkf']:.1f} times EnKF, {cost['renpf'] / cost['enpf']:.1f} "
         "times EnPF", bool(cost["renpf"] > 2 * max(cost["enkf"], cost["enpf"]))),
    ]  # fmt: skip


TEXT = """\
## Alignment of a strapdown system on the move (Shao et al. 2020, REnPF)

A drive of 600 s (up to 2 m/s2 and 30 m/s, small S-shaped turns), inertial sensors and GPS as in the paper's table 1,
first attitude off by 10, -10 and 30 degrees; 15 errors, 6 readings a second, closed loop. {count} runs
of each case without outliers, {spoiled_count} with. The drive is ours, since the paper shows its own only as a picture.
`enpf-chi2` has the paper's gate of {gate}.

![The drive](alignment_drive.png)

### Simulation one: no outliers (the paper's figure 5 and table 4)

{clean}

The numbers of the paper's table 4 are in a picture that is not in its text, so nothing stands beside ours.

![Mean attitude errors](alignment_clean.png)

### Simulation two: outliers of 15 m and 0.5 m/s at 400, 500 and 600 s (its figures 6 and 7, table 6)

{spoiled}

"Moved by an outlier": by how many degrees an outlier's epoch changes the attitude error, mean over runs and outliers.

![Normalised innovations](alignment_innovation.png)

![Attitude errors with outliers](alignment_outliers.png)

### Time (its table 5)

{speed}

The numbers of the paper's table 5 are not in its text either; it says only that REnPF costs far more than the others.
All runs of this section took {seconds:.0f} s.

### Beside the paper

{claims}
The gate of {gate} is the 75 % point of chi-square with 5 degrees of freedom, where the readings have 6: it refuses a
third of good readings by design. `enkf-chi2` is no filter of the paper: it is the ensemble Kalman filter behind the
same gate, and shows what the gate does without particles. {few} members cannot span 15 errors: where their covariance
shrinks faster than the error, the normalised innovation grows, the gate shuts, and no reading opens it again. The paper
reports but a few false alarms, which needs more members than it names, or larger noises than those of its table 1.

Our filters know the true noises of the sensors; the paper does not say what noises its filters assume. What is left of
the level error is what the accelerometers' bias of 1e-4 g cannot be told from, 0.0057 degrees.
"""
