"""The logs over which two versions are compared, and rules switched off: sample data, every scenario, what instruments
do, logs with faults, and flights of several stations."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ftproc import pipeline
from ftproc.config.reading import load
from ftproc.config.recipe import Recipe
from ftproc.files.reading import logs as reading
from ftproc.files.writing import ranges
from ftproc.fusion import flight, range_file
from ftproc.records import FloatArray, MeasurementLog, Trajectory
from ftproc.settings import FilterSettings
from ftproc.simulation import list_scenarios, parse_instrument, simulate
from ftproc.simulation.ranges import RANGES, simulate_range
from tests import drone
from tests.bench import instruments
from tests.trust import faulty_logs, hard, hard_flights

SEEDS = (300, 301)
LONGEST_S = 240.0
#: Seconds between the readings of a total station, and its 1-sigma m, rad, rad.
DRONES = {"1": (0.02, 3e-5, 3e-5), "0.5": (0.005, 1e-5, 1e-5), "0.2": (0.002, 1e-5, 1e-5)}
#: Seconds between the ranges of an instrument, and from each to the angles that belong to it.
APART = {"5": 0.006, "0.5": 0.001}
GAPS = (9, 11, 43, 57)  # flights with gaps
LOCKED = ("0.1/301", "0.1/305", "0.2/302")  # seconds between readings while a mount that has locked on swings
WEAVING = ("0.2/301", "0.2/303", "0.2/306")  # of an aircraft that weaves on its way to or from the instrument
FALLING = ("0.05/206", "0.05/217", "0.5/221", "1/205")  # bombs and shells in wind, and rockets of few readings
COARSE, OFF = ("2", "4"), 0.05  # sigmas to which a glider's readings are rounded, and share of outliers among them
WAVES = ("sine/8", "sine/9", "sine/36", "sine/42", "sine/54")  # patches of hard flights that go to and fro
HELD_S = 1200.0  # of an aircraft that holds, at 10 Hz
SAMPLES = Path(__file__).parents[2] / "sample_data"


class Seen(NamedTuple):
    """A log, or the folder of a range file, and the truth: times (n,) and positions (n, 3) m, row for row with a log;
    None where there is none."""

    log: MeasurementLog | Path
    time_s: FloatArray | None = None
    position_m: FloatArray | None = None


def names() -> list[str]:
    """Of all logs, by kind, name and seed."""
    scenarios = [f"scenario/{name}/{seed}" for name in list_scenarios() for seed in SEEDS]
    effects = [
        f"effect/{scenario}, {effect}/{SEEDS[0]}"
        for scenario in instruments.SCENARIOS
        for effect in instruments.EFFECTS
        if effect != "none"
    ]
    faults = [f"fault/{name}/{seed}" for name in faulty_logs.CLASSES for seed in SEEDS]
    slow = [f"drone/{dt_s}/{seed}" for dt_s in DRONES for seed in SEEDS]
    slow += [f"apart/{dt_s}/{seed}" for dt_s in APART for seed in SEEDS]
    slow += [f"holding/0.1/{seed}" for seed in (*SEEDS, 404)]  # of which one seems to have three times its noise,
    slow += [f"soaring/1/{seed}" for seed in (78, *SEEDS)]  # and of these one to be off in its circles
    slow += [f"coarse/{step}/{seed}" for step in COARSE for seed in SEEDS]
    slow += [*(f"locked/{what}" for what in LOCKED), *(f"weaving/{what}" for what in WEAVING)]
    slow += [f"falling/{what}" for what in FALLING]
    waves = [f"gaps/all/{number}" for number in GAPS] + [f"hard/{what}" for what in WAVES]
    fused = [f"range/{name}/{seed}" for name in RANGES for seed in SEEDS]
    samples = [f"sample/{path.name}/0" for path in sorted(SAMPLES.iterdir()) if _is_log(path)]
    return [*samples, "range/sample/0", *scenarios, *effects, *faults, *waves, *slow, *fused]


def _is_log(path: Path) -> bool:
    return path.suffix in (".csv", ".parquet") and ".truth." not in path.name


def trajectory(name: str, settings: FilterSettings) -> tuple[Trajectory, FloatArray | None]:
    """What the program makes of a log, and the true positions (n, 3) m of its rows, NaN where not known."""
    with tempfile.TemporaryDirectory() as room:
        seen = _make(name, Path(room))
        if isinstance(seen.log, MeasurementLog):
            return pipeline.filter_log(seen.log, settings), seen.position_m
        found = flight.fuse(range_file.load(str(seen.log / "range.toml")), settings).trajectory
    if seen.time_s is None or seen.position_m is None:
        return found, None
    axes = (np.interp(found.time_s, seen.time_s, axis, np.nan, np.nan) for axis in seen.position_m.T)
    return found, np.stack(list(axes), 1)


def _make(name: str, room: Path) -> Seen:
    kind, what, seed = name.split("/")
    return _MAKERS[kind](what, int(seed), room)


def _scenario(what: str, seed: int, room: Path) -> Seen:
    found = simulate(what, seed=seed)
    if found.truth.time_s[-1] > LONGEST_S:
        found = simulate(what, seed=seed, duration_s=LONGEST_S)
    return Seen(found.log, found.truth.time_s, found.truth.position_m)


def _falling(what: str, seed: int, room: Path) -> Seen:
    found = simulate("ballistic", seed=seed, dt_s=float(what))
    return Seen(found.log, found.truth.time_s, found.truth.position_m)


def _effect(what: str, seed: int, room: Path) -> Seen:
    scenario, effect = what.split(", ")
    spec = instruments.EFFECTS[effect][list(instruments.SCENARIOS).index(scenario)]
    make = partial(simulate, scenario, seed=seed, duration_s=instruments.SCENARIOS[scenario], outliers="none")
    found = make(instrument=parse_instrument(spec))
    return Seen(found.log, found.truth.time_s, found.truth.position_m)


def _fault(what: str, seed: int, room: Path) -> Seen:
    found = faulty_logs.make(what, seed).simulated
    return Seen(found.log, found.truth.time_s, found.truth.position_m)


def _hard(what: str, seed: int, room: Path) -> Seen:
    found = hard.make(what, seed).simulated
    return Seen(found.log, found.truth.time_s, found.truth.position_m)


def _drone(what: str, seed: int, room: Path) -> Seen:
    log, position_m = drone.seen(seed, float(what), DRONES[what])
    return Seen(log, log.time_s, position_m)


def _apart(what: str, seed: int, room: Path) -> Seen:
    log, position_m = drone.apart(seed, float(what), APART[what])
    return Seen(log, log.time_s, position_m)


def _holding(what: str, seed: int, room: Path) -> Seen:
    log, position_m = drone.holding(seed, float(what), HELD_S)
    return Seen(log, log.time_s, position_m)


def _soaring(what: str, seed: int, room: Path) -> Seen:
    log, position_m = drone.soaring(seed)
    return Seen(log, log.time_s, position_m)


def _coarse(what: str, seed: int, room: Path) -> Seen:
    log, position_m = drone.soaring(seed)
    return Seen(drone.coarse(log, float(what), OFF, seed), log.time_s, position_m)


def _locked(what: str, seed: int, room: Path) -> Seen:
    log, position_m = drone.locked(seed, float(what))
    return Seen(log, log.time_s, position_m)


def _weaving(what: str, seed: int, room: Path) -> Seen:
    log, position_m = drone.weaving(seed, float(what))
    return Seen(log, log.time_s, position_m)


def _gaps(what: str, seed: int, room: Path) -> Seen:
    found = hard_flights.with_gaps(seed).simulated
    return Seen(found.log, found.truth.time_s, found.truth.position_m)


def _range(what: str, seed: int, room: Path) -> Seen:
    if what == "sample":
        return Seen(SAMPLES / "range")
    found = simulate_range(what, seed, 60.0)
    ranges.write(found, str(room / "range"), None)
    return Seen(room / "range", found.truth.time_s, found.truth.position_m)


def _sample(what: str, seed: int, room: Path) -> Seen:
    station = (SAMPLES / what).with_suffix(".toml")
    options = Recipe.of(load(station)).reading() if station.exists() else {}
    return Seen(reading.read(str(SAMPLES / what), **options))


_MAKERS: dict[str, Callable[[str, int, Path], Seen]] = {
    "sample": _sample,
    "scenario": _scenario,
    "effect": _effect,
    "fault": _fault,
    "hard": _hard,
    "drone": _drone,
    "apart": _apart,
    "holding": _holding,
    "soaring": _soaring,
    "coarse": _coarse,
    "locked": _locked,
    "weaving": _weaving,
    "falling": _falling,
    "gaps": _gaps,
    "range": _range,
}


def ways(name: str) -> Iterator[tuple[str, FilterSettings]]:
    """In which a log is processed to compare two versions: every one once filtered and smoothed, some live."""
    yield "filter", FilterSettings()
    yield "smooth", FilterSettings(smooth=True)
    if name.startswith(("sample", "scenario")) and name.endswith(("/0", f"/{SEEDS[0]}")):
        yield "live", FilterSettings(editing="live")
        yield "live, lag 2 s", FilterSettings(editing="live", lag_s=2.0)
        yield "forward", FilterSettings(editing="forward")
