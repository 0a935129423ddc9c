"""Faults of the instrument in a run's summary, and in words: steps that stay, readings that were not measured, errors
on one side, a clock that was set back."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ftproc.files.moments import Moments
from ftproc.records import COMPONENTS, FloatArray, IntArray, MeasurementLog

if TYPE_CHECKING:
    from ftproc.core.editing.lasting.faults import Faults

NAMES, UNITS = (*COMPONENTS, "clock"), ("m", "rad", "rad", "s")
MOST_STEPS = 5  # that are named
FEWEST_OVERLAPPING = 6  # changes between rows before and rows after, of those at the same times


class FaultStatistics:
    """The faults of a log, to which those of its parts are added in their order."""

    def __init__(self) -> None:
        self.copies = np.zeros((len(COMPONENTS), 4), int)
        self.steps: list[dict[str, Any]] = []
        self.doubtful: list[dict[str, Any]] = []
        self.rivals: list[dict[str, Any]] = []
        self.one_sided: dict[str, dict[str, Any]] = {}

    def add(self, time_s: FloatArray, faults: Faults) -> None:
        """Add those of a part: time_s (n,)."""
        self.copies += [np.bincount(kind, minlength=4) for kind in faults.copied.T]
        for step in faults.steps:
            sizes = {"size": step.size, "sigma": step.sigma}
            found = {"component": NAMES[step.component], "time_s": float(time_s[step.sample])}
            found |= {f"{what}_{UNITS[step.component]}": size for what, size in sizes.items()}
            (self.steps if step.sure else self.doubtful).append(found)
        for rival in faults.rivals:
            name, from_s, to_s = NAMES[rival.component], float(time_s[rival.begin]), float(time_s[rival.end - 1])
            what = f"the {name} from {from_s:.6g} to {to_s:.6g} s, taken for {rival.chosen}, may be {rival.other}"
            where = {"component": name, "from_s": from_s, "to_s": to_s}
            self.rivals.append({"what": what, "nats": rival.gain, **where, "chosen": rival.chosen})
        for one in faults.one_sided:
            name, unit = NAMES[one.component], UNITS[one.component]
            found = {"component": name, "share": one.share, f"error_{unit}": one.error, f"shift_{unit}": one.shift}
            if one.share >= self.one_sided.get(name, {"share": 0.0})["share"]:
                self.one_sided[name] = found

    def figures(self) -> dict[str, Any]:
        """JSON-serialisable; units are in the names."""
        one_sided = list(self.one_sided.values())
        found = {"steps": self.steps, "doubtful_steps": self.doubtful, "rivals": self.rivals}
        return {**found, "one_sided_errors": one_sided}

    def of_component(self, c: int) -> dict[str, int]:
        """How many readings of a component were not measured."""
        return copies(self.copies[c])


def clock_set_back(log: MeasurementLog) -> dict[str, float] | None:
    """Where the time goes back, and by how much, with rows before and after it that overlap; None if nowhere. A few
    rows that come late do not count."""
    if not log.rows_out_of_order:
        return None
    order = np.argsort(log.row, kind="stable")
    time_s = log.time_s[order]
    change = np.diff(time_s)
    at = int(change.argmin())
    overlap = (log.time_s >= time_s[at + 1]) & (log.time_s <= time_s[at])
    after = log.row[overlap] > log.row[order[at]]
    if np.count_nonzero(after[1:] != after[:-1]) < FEWEST_OVERLAPPING:
        return None
    return {"row": int(log.row[order[at + 1]]), "by_s": float(change[at])}


def suspicious(s: Mapping[str, Any]) -> Iterator[str]:
    """The faults of a summary of which a single log cannot tell what is right."""
    steps = s["steps"]
    if steps:
        named = "; ".join(step_in_words(step, s) for step in steps[:MOST_STEPS])
        rest = f"; and {len(steps) - MOST_STEPS} more" if len(steps) > MOST_STEPS else ""
        yield f"{named}{rest}: the estimate follows the longer side, which may be the wrong one"
    if s["doubtful_steps"]:
        named = "; ".join(step_in_words(step, s) for step in s["doubtful_steps"][:MOST_STEPS])
        yield f"either {named}, or readings beside it are a patch of outliers: the estimate takes them for good"
    for rival in s["rivals"][:MOST_STEPS]:
        less = f"less likely by {rival['nats']:.1f} in log-probability only"
        more = "likelier by the readings around it, but the track is lost with it"
        yield f"{rival['what']}: that is {less if rival['nats'] >= 0 else more}"
    if s["clock_set_back"]:
        back = s["clock_set_back"]
        yield f"the time goes back by {-back['by_s']:.3g} s at row {back['row']}, and rows before and after it overlap"
    for one in s["one_sided_errors"]:
        if not one["share"]:
            yield f"{one['component']} errors have two peaks, or a flat one: some readings are off, all to one side"
            continue
        error, shift = (_size(one, what) for what in ("error", "shift"))
        yield (
            f"{one['component']} errors lie on one side in about {100 * one['share']:.0f} % of the readings, by "
            f"{error} on average: the estimate leans to the other side by {shift.lstrip('+-')}"
        )


def allowed_for(s: Mapping[str, Any]) -> Iterator[str]:
    """The faults of a summary that cost readings only."""
    for name, part in s["components"].items():
        yield from copies_in_words(name, part, part["good"] + part["isolated"] + part["patch"])


def copies(count: IntArray) -> dict[str, int]:
    """Readings (kinds,) that were not measured, see `core.editing.copies`, by kind."""
    return dict(zip(("held", "interpolated", "computed"), map(int, count[1:]), strict=True))


def copies_in_words(name: str, part: Mapping[str, int], measured: int) -> Iterator[str]:
    """What of a component was not measured. part: how many readings are of each kind; measured: are left."""
    rate = f"these count as missing, and {measured} readings are left"
    if part["held"]:
        yield f"{name} repeats the reading before in {part['held']} rows: {rate}"
    if part["interpolated"]:
        yield f"{name} is interpolated between other readings in {part['interpolated']} rows: {rate}"
    if part["computed"]:
        yield f"{name} has no noise in {part['computed']} rows, as if a tracker coasts: {rate}"


def step_in_words(step: Mapping[str, Any], s: Mapping[str, Any]) -> str:
    """A step of a summary, such as: azimuth steps by -4.1 mrad at 60.1 s."""
    what = "the clock jumps" if step["component"] == "clock" else f"{step['component']} steps"
    return f"{what} by {size_in_words(step)} at {Moments.of_summary(s).words(step['time_s'])}"


def size_in_words(step: Mapping[str, Any]) -> str:
    """Its size, such as -4.1 mrad."""
    return _size(step, "size")


def _size(fault: Mapping[str, Any], what: str) -> str:
    """A size with its sign and unit."""
    for unit in ("m", "s"):
        if f"{what}_{unit}" in fault:
            return f"{fault[f'{what}_{unit}']:+.3g} {unit}"
    return f"{1e3 * fault[f'{what}_rad']:+.3g} mrad"
