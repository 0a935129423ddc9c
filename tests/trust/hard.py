"""The table of hard faults on hard flights: classes of faults by the flights of `hard_flights`, filter and smoother.

    python -m tests.trust.hard 0-4 offset exchange     seeds 0 to 4 of two classes; all of them where none is named
    python -m tests.trust.hard 0-4 -v -j 2             a line for each run, by two processes

Wrong, missed and false alarms are as in `runs`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from ftproc.core.model.frames import from_cartesian, wrap
from ftproc.simulation import Simulation
from tests.trust import hard_flights, runs, tables
from tests.trust.hard_flights import Seen
from tests.trust.runs import Faulty, Run
from tests.trust.tables import Bound

ENDS = "start", "end"
Fault = Callable[[Seen, int], str]  # the specification of a fault, for a flight and a seed


def _lasts(seen: Seen, low_s: float, high_s: float) -> str:
    """Seconds as LENGTH in a specification: at least four samples, at most a third of the log."""
    most = min(high_s, seen.lasts_s / 3)
    return f"{min(max(low_s, 4 * seen.dt_s), most):.6g}-{most:.6g}s"


def _jump(seen: Seen) -> str:
    """Seconds by which a clock jumps: at least two samples, at most a tenth of the log."""
    low, high = min(max(0.2, 2 * seen.dt_s), 0.05 * seen.lasts_s), min(max(2.0, 3 * seen.dt_s), 0.1 * seen.lasts_s)
    return f"{low:.6g}-{high:.6g}"


def _patch(kind: str) -> Fault:
    size = {"stuck": "", "mirror": "", "sine": ":20-200"}.get(kind, ":8-200")
    return lambda seen, seed: f"one.{kind}=1:{_lasts(seen, 2, 60)}{size}"


PATCHES = {kind: _patch(kind) for kind in ("offset", "ramp", "walkoff", "sine", "stuck", "mirror", "sidelobe")}
COMBINED: dict[str, Fault] = {
    "three": lambda seen, seed: f"one.mixed=3:{_lasts(seen, 2, 20)}:8-200",
    "two": lambda seen, seed: f"two.mixed=1:{_lasts(seen, 2, 60)}:8-200",
    "ends": lambda seen, seed: f"one.mixed=1:{_lasts(seen, 2, 30)}@{ENDS[seed % 2]}:8-200",
    "exchange": lambda seen, seed: f"all.other=1:{_lasts(seen, 20, 20)}:30-300",
    "blocks": lambda seen, seed: f"all.{('replay', 'swap')[seed % 2]}=1:{_lasts(seen, 2, 20)}",
    "missing": lambda seen, seed: f"{('', 'all.')[seed % 2]}nan=0.5,one.mixed=2:{_lasts(seen, 2, 20)}:8-200",
}
CHANGES: dict[str, Fault] = {
    "step": lambda seen, seed: "one.step=1:10-100",
    "clock": lambda seen, seed: f"{('late', 'clock')[seed % 2]}=1:{_jump(seen)}",
    "noise": lambda seen, seed: "noise=1:33%:10",
    "noiseless": lambda seen, seed: "one.noise=1:100%:0",
    "ar1": lambda seen, seed: f"correlation={seen.dt_s * (2, 4, 8)[seed % 3]:.6g}",
}
DIRT: dict[str, Fault] = {
    "isolated": lambda seen, seed: f"isolated={(0.01, 0.1, 0.2, 0.4)[seed % 4]}:6-300",
    "second": lambda seen, seed: "isolated=0.5:6-10",
}
SOUND: dict[str, Fault] = {
    "clean": lambda seen, seed: "none" if seed % 2 else "jitter=0.2",
    "abrupt": lambda seen, seed: "none",
}
MANY: dict[str, Fault] = {  # of each component
    "seldom": lambda seen, seed: "patch=1:4-60:8-200,mixed=1:10-200:8-200",
    "often": lambda seen, seed: "isolated=0.02:6-300,patch=3:4-60:8-200,mixed=3:10-200:8-200",
}
GROUPS = {"patches": PATCHES, "combined": COMBINED, "changes": CHANGES, "dirt": DIRT, "sound": SOUND, "many": MANY}
#: Of the groups, a little above what is reached.
BOUNDS = {
    "patches": Bound(wrong=0.1, confident=0.02),
    "combined": Bound(wrong=0.4, confident=0.05),
    "changes": Bound(wrong=0.12, confident=0.02),
    "dirt": Bound(wrong=0.05, confident=0.02),
    "sound": Bound(wrong=0.02, reported=0.22),
    "many": Bound(wrong=0.6, confident=0.05),
}
SEEDS = 5
SHOWN = {*PATCHES, *COMBINED, "step", "clock"}
FEWEST_SHOWN, MOST_DRAWN = 4, 20  # readings, and faults drawn
CLASSES = {name: fault for group in GROUPS.values() for name, fault in group.items()}


def make(name: str, seed: int) -> Faulty:
    """The log of a class and a seed, always the same. Each class begins at another flight; a fault that the log does
    not show is drawn again."""
    own = list(CLASSES).index(name)
    take = hard_flights.take_abrupt if name == "abrupt" else hard_flights.take
    seen = take(seed + 5 * own, np.random.default_rng([own, seed]))
    for drawn in range(MOST_DRAWN):
        made = hard_flights.log(seen, CLASSES[name](seen, seed), f"{name} {seed}", [own, seed, drawn])
        if name not in SHOWN or _shows(made.simulated):
            break
    return made


def _shows(simulated: Simulation) -> bool:
    """Whether some readings are far from the truth."""
    off = simulated.log.measurement - from_cartesian(simulated.truth.position_m)
    off[:, 1] = wrap(off[:, 1])
    return bool((np.abs(off) > runs.MISSED_SIGMAS * np.array(simulated.sigma)).sum() >= FEWEST_SHOWN)


def run(name: str, seed: int) -> list[Run]:
    """A log filtered and smoothed."""
    return runs.run(name, seed, make(name, seed))


def table(found: list[Run]) -> Iterator[tuple[str, ...]]:
    """A row for each class and each group that was run."""
    for group, faults in GROUPS.items():
        names = [name for name in faults if runs.of(name, found)]
        yield from (runs.row(name, runs.of(name, found)) for name in names)
        if len(names) > 1:
            yield runs.row(f"all {group}", of_group(group, found))


def of_group(group: str, found: list[Run]) -> list[Run]:
    """The runs of the classes of a group."""
    return [run for run in found if run.name in GROUPS[group]]


def main() -> None:
    """Print the table."""
    given = tables.arguments(__doc__, CLASSES)
    found = list(tables.spread(run, given.jobs, given))
    tables.show(runs.HEADER, table(found))


if __name__ == "__main__":
    main()
