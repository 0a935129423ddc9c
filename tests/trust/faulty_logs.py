"""Logs with faults that they themselves betray, and clean and ordinarily dirty ones, with their truth: on flights that
are easy to follow."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ftproc.simulation.contamination import CODES
from tests.trust import hard_flights
from tests.trust.hard_flights import Seen
from tests.trust.runs import Faulty

Draw = np.random.Generator
Fault = Callable[[Draw, int], str]  # the specification of a fault that is drawn, for a seed
AMBIGUITIES_M = (29.98, 149.9, 749.5, 1498.96)


def fly(draw: Draw) -> Seen:
    """One of four kinds of flight with its sampling and noise."""
    lasts_s, place = draw.uniform(70, 170), (draw.uniform(4e3, 12e3), draw.uniform(700, 4000))
    kind = str(draw.choice(["singer", "circles", "weave", "fall"]))
    flight = {
        "singer": lambda: hard_flights.singer(
            draw.uniform(1, 12), draw.uniform(6, 20), draw.uniform(60, 260), place, draw, lasts_s
        ),
        "circles": lambda: hard_flights.circles(draw.uniform(900, 3500), draw.uniform(50, 160), place, draw, lasts_s),
        "weave": lambda: hard_flights.weave(
            draw.uniform(1, 20), draw.uniform(18, 45), draw.uniform(70, 240), place, draw, lasts_s
        ),
        "fall": lambda: hard_flights.lobbed(
            draw.uniform(60, 200), draw.uniform(0.2, 1.2), draw.uniform(30, 90), place[0], draw, lasts_s
        ),
    }[kind]()
    dt_s = float(draw.choice([0.04, 0.07, 0.125, 0.2, 0.25]))
    return Seen(kind, flight, lasts_s, dt_s, np.array([draw.uniform(0.8, 9), *draw.uniform(0.08e-3, 0.7e-3, 2)]))


def _dirty(draw: Draw, seed: int) -> str:
    """Isolated outliers, short patches, missing readings, a gap: what every log has."""
    patches = f"one.offset={draw.integers(0, 4)}:4-17:12-120"
    gap = "gap=1:0.8-2.5" if seed % 3 == 0 else "gap=0:1"
    return f"isolated={draw.uniform(0.002, 0.06):.3f}:7-300,{patches},nan={draw.choice([0.0, 0.03])},{gap}"


def _among_outliers(spec: str, they_are: bool) -> str:
    return f"{spec},isolated=0.02:8-100" if they_are else spec


def _step(sigmas: int) -> Fault:
    return lambda draw, seed: f"{_component(seed)}.step=1:{sigmas}"


def _component(seed: int) -> str:
    return ("range", "azimuth", "elevation")[seed % 3]


def _together(seed: int) -> str:
    return ("all", "range", "azimuth", "elevation", "azimuth+elevation")[seed % 5]


def _held(draw: Draw, seed: int) -> str:
    """Some of the readings, or all but one in a few."""
    if seed % 2:
        return f"{_together(seed)}.held={draw.uniform(0.3, 0.75):.2f}"
    return f"{_together(seed)}.held={1 - 1 / draw.integers(2, 8):.3f}"


#: Class -> the specification of its fault.
FAULTS: dict[str, Fault] = {
    "clean": lambda draw, seed: "jitter=0.2" if seed % 2 else "none",
    "dirty": _dirty,
    **{f"step of {sigmas} sigma": _step(sigmas) for sigmas in (10, 20, 50, 100)},
    "several steps": lambda draw, seed: _among_outliers(f"one.step={draw.integers(2, 4)}:12-90", seed % 2 == 1),
    "range ambiguity": lambda draw, seed: _among_outliers(
        f"range.step=1:{draw.choice(AMBIGUITIES_M[seed % 2 :])}m", seed % 3 == 0
    ),
    "another lobe": lambda draw, seed: "azimuth+elevation.step=1:15-80",
    "clock jump": lambda draw, seed: f"{('late', 'clock')[seed % 3 > 0]}=1:0.2-2",
    "held": _held,
    "resampled": lambda draw, seed: f"{_together(seed)}.interpolated={draw.choice([3, 5, 8]) + seed % 2 * 0.37}",
    "one-sided errors": lambda draw, seed: f"{_component(seed)}.onesided={draw.uniform(0.45, 0.65):.2f}:4-14",
}
CLASSES = tuple(FAULTS)
SOUND = ("clean", "dirty")


def make(name: str, seed: int) -> Faulty:
    """The log of a class and a seed; the same bytes each time."""
    own = CLASSES.index(name)
    draw = np.random.default_rng([own, seed])
    made = hard_flights.log(fly(draw), FAULTS[name](draw, seed), f"{name} {seed}", [own, seed, 1])
    return _without_track(made, draw) if name == "another lobe" and seed % 2 else made


def _without_track(made: Faulty, draw: Draw) -> Faulty:
    """The same with a short loss of track before the step."""
    log, code = made.simulated.log, made.simulated.truth.outlier
    assert code is not None
    first = int(np.argmax((code == CODES["step"]).any(1)))
    reading = log.measurement.copy()
    reading[first - int(draw.integers(2, 1 + int(1.0 / (log.time_s[1] - log.time_s[0])))) : first] = np.nan
    simulated = replace(made.simulated, log=replace(log, measurement=reading))
    return Faulty(simulated, f"{made.what} after a loss of track")
