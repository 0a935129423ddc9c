"""What a fused flight shows of its stations: stretches on another target, silences, contradictions; and the verdict."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.identification.stretches import runs_of
from ftproc.files import layout
from ftproc.fusion import notes
from ftproc.fusion.estimation.constants import IMPROBABLE, WORDS
from ftproc.fusion.estimation.events import APART_M, CLOCK, OFFSET
from ftproc.fusion.estimation.whole import Fused
from ftproc.quality import consistency, faults
from ftproc.quality.verdict import (
    CONSISTENT,
    MANY_REJECTED,
    SUSPECT,
    TOO_MANY_REJECTED,
    UNRELIABLE,
    Remark,
    cut_short,
    too_fast,
)
from ftproc.records import FloatArray

WRONG_S, WRONG_ROWS = 3.0, 6  # seconds and rows that all of a station's readings are rejected: another target
BRIDGED = 4  # rows within that are good by chance
DETERMINED, UNCHECKED_S = 3, 10.0  # components that determine a place with nothing to spare, for longer than a patch
SILENT_S, SILENT_INTERVALS = 10.0, 25.0  # without a reading
LATE = 0.03  # of the flight
SCATTERED = 5.0  # times its own noise
FEWEST = 10  # readings of a component, for its share of rejections to mean anything
CORRELATED, CORRELATED_SIGMAS = 0.3, 4.0  # of residuals that follow each other: coefficient, and in its 1-sigma

#: Is said with every consistent fused flight.
NOT_SHOWN = (
    "Stations together cannot show what is wrong with all of them alike: a clock offset or a tilt that they share, "
    "places in a wrong frame, or a false target that all follow."
)


class Stretch(NamedTuple):
    """A station from first_s to last_s, true time in s. kind: another target, silent, joins late, leaves early."""

    station: str
    first_s: float
    last_s: float
    kind: str


def stretches(fused: Fused) -> list[Stretch]:
    """What happened to each station, in the order of time; times from the first reading."""
    found = []
    begin, end = (float(fused.track.time_s[k]) for k in (0, -1))
    for s, station in enumerate(fused.stations):
        time_s = station.time_s - fused.constants.estimate[s, CLOCK]
        found += [Stretch(station.name, *ends, "another target") for ends in _elsewhere(fused, s, time_s)]
        seen = time_s[fused.possible[s].any(1)]
        if len(seen) < 2:
            continue
        least = max(SILENT_S, SILENT_INTERVALS * float(np.median(np.diff(seen))), LATE * (end - begin))
        if seen[0] - begin > least:
            found.append(Stretch(station.name, begin, float(seen[0]), "joins late"))
        if end - seen[-1] > least:
            found.append(Stretch(station.name, float(seen[-1]), end, "leaves early"))
        silent = np.flatnonzero(np.diff(seen) > least)
        found += [Stretch(station.name, float(seen[k]), float(seen[k + 1]), "silent") for k in silent]
    return sorted(found, key=lambda each: each.first_s)


def _elsewhere(fused: Fused, s: int, time_s: FloatArray) -> Iterator[tuple[float, float]]:
    """From and to where all readings of a station are rejected."""
    yield from _long_runs(time_s, fused.possible[s].max(1), fused.weight[s].max(1))


def _long_runs(time_s: FloatArray, possible: FloatArray, weight: FloatArray) -> Iterator[tuple[float, float]]:
    """From and to where none of the possible readings are used; (n,) each."""
    rows = np.flatnonzero(possible > 0)
    for first, last in runs_of(_closed(weight[rows] <= 0, BRIDGED)):
        if last - first >= WRONG_ROWS and time_s[rows[last - 1]] - time_s[rows[first]] >= WRONG_S:
            yield float(time_s[rows[first]]), float(time_s[rows[last - 1]])


def _closed(flag: NDArray[np.bool_], most: int) -> NDArray[np.bool_]:
    """Gaps of at most so many between runs of true filled, where the runs are longer."""
    found = flag.copy()
    runs = runs_of(flag)
    for (a, b), (c, d) in itertools.pairwise(runs):
        if c - b <= most and min(b - a, d - c) > c - b:
            found[b:c] = True
    return found


def component_figures(fused: Fused, s: int) -> dict[str, Any]:
    """Counts, noise and the test of the residuals of a station, by component."""
    station, found = fused.stations[s], {}
    residual, variance = fused.residual[s], fused.residual_variance[s]
    for c in station.components:
        seen, used = np.isfinite(station.measurement[:, c]), fused.weight[s][:, c] > 0
        squares = residual[used, c] ** 2 / variance[used, c]
        unit, scale = ("m", station.away_m if c else 1.0) if station.away_m else (("m", "rad", "rad")[c], 1.0)
        found[station.names[c]] = {
            "good": int(used.sum()),
            "rejected": int((seen & ~used).sum()),
            "missing": int((~seen).sum()),
            **faults.copies(station.copied[c]),
            f"noise_{unit}": float(fused.noise[s, c]) * scale,
            "residual_ratio": float(np.sqrt(squares.mean())) if len(squares) else None,
        }
    for name, each in fused.beside[s].items() if fused.beside else ():
        seen, used = np.isfinite(each.side.value), (each.side.weight > 0) & each.side.used
        if not each.side.used and each.side.why:
            continue
        squares = each.residual[used] ** 2 / each.variance[used]
        found[name] = {
            "good": int((each.side.weight[seen] > 0).sum()),
            "rejected": int((each.side.weight[seen] <= 0).sum()),
            "missing": int((~seen).sum()),
            f"noise_{layout.BESIDE[name]}": each.side.sigma,
            "residual_ratio": float(np.sqrt(squares.mean())) if len(squares) else None,
        }
    return found


def remarks(fused: Fused, zero_s: float) -> list[Remark]:
    """All remarks on a fused flight. zero_s: the logs' time of the first reading."""
    return [
        *notes.notes(fused, zero_s),
        *_steps(fused, zero_s),
        *_unstated(fused),
        *_improbable(fused),
        *too_fast(consistency.least_acceleration(fused.track.state, fused.track.sigma)),
        *_scattered(fused),
        *_correlated(fused),
        *_rejections(fused),
        *_stretches(fused, zero_s),
        *_unchecked(fused, zero_s),
        *_poorly(fused, zero_s),
        *_unsettled(fused),
    ]


def _improbable(fused: Fused) -> Iterator[Remark]:
    c = fused.constants
    for s, station in enumerate(fused.stations):
        if c.prior[s, OFFSET] == APART_M:
            heard = [k for k in range(len(fused.stations)) if k != s and c.prior[k, OFFSET] > 0]
            off = f"{c.estimate[s, OFFSET] - c.estimate[heard[0], OFFSET]:+.3g} m"
            text = f"the heights of {station.name} lie {off} above those of {fused.stations[heard[0]].name}"
            text += ": another setting of the air's pressure, or another zero, of one of them?"
            yield Remark(SUSPECT, f"{text} The estimate allows for it")
        for j, word in enumerate(WORDS):
            if c.prior[s, j] > 0 and abs(c.estimate[s, j]) > IMPROBABLE * c.prior[s, j]:
                times = abs(c.estimate[s, j]) / c.prior[s, j]
                yield Remark(
                    SUSPECT,
                    f"the {word} of {station.name} is {times:.0f} times its 1-sigma of the range file: check its "
                    "place, its clock and its conventions, or that 1-sigma",
                )


def _steps(fused: Fused, zero_s: float) -> Iterator[Remark]:
    """Components and clocks that step for good, which the others have shown; they were put right."""
    for each in fused.steps:
        name, unit = faults.NAMES[each.component], faults.UNITS[each.component]
        step = {"component": name, "time_s": each.time_s + zero_s, f"size_{unit}": each.size}
        yield Remark(SUSPECT, f"{each.station}: {faults.step_in_words(step, {})}; the estimate allows for it")


def _unstated(fused: Fused) -> Iterator[Remark]:
    """Components that contradict the range file throughout, whose biases were estimated for that."""
    for c, key in enumerate(("range_bias_sigma_m", "azimuth_bias_sigma_mrad", "elevation_bias_sigma_mrad")):
        named = [s for s, station in enumerate(fused.stations) if c in station.unstated]
        if not named:
            continue
        names = " and ".join(fused.stations[s].name for s in named)
        off, word = max(fused.constants.prior[s, c] for s in named), fused.stations[named[0]].names[c]
        size = f"{1000 * off:.3g} mrad" if c else f"{off:.3g} m"
        text = f"{names}: the {word} readings are off by {size} from "
        text += "first to last, against the range file, which takes them as exact; the bias is taken as unknown. State "
        yield Remark(SUSPECT, f"{text}{key}, and check the places and the conventions")


def _scattered(fused: Fused) -> Iterator[Remark]:
    """Stations whose readings are far from the fused trajectory, beside the noise that they show by themselves."""
    for s, station in enumerate(fused.stations):
        times = max((fused.noise[s, c] / fused.own[s, c] for c in station.components), default=0.0)
        if times > SCATTERED:
            text = f"{station.name} contradicts the others: its readings scatter about the fused trajectory by "
            text += f"{times:.0f} times their own noise; check its place, its clock and its conventions"
            yield Remark(SUSPECT, text)


def _correlated(fused: Fused) -> Iterator[Remark]:
    """Components whose residuals keep their sign from reading to reading, as they do where readings are wrong alike."""
    for s, station in enumerate(fused.stations):
        residual, variance = fused.residual[s], fused.residual_variance[s]
        for c in station.components:
            used = fused.weight[s][:, c] > 0
            z = residual[used, c] / np.sqrt(variance[used, c])
            if len(z) < FEWEST:
                continue
            coefficient = float(z[1:] @ z[:-1] / (z @ z))
            if coefficient > max(CORRELATED, CORRELATED_SIGMAS / np.sqrt(len(z))):
                yield Remark(
                    SUSPECT,
                    f"the {station.names[c]} residuals of {station.name} are correlated from reading to reading "
                    f"(coefficient {coefficient:.2f}): outliers may be among its good readings, the sigmas too small",
                )


def _rejections(fused: Fused) -> Iterator[Remark]:
    for s, station in enumerate(fused.stations):
        possible, used = np.isfinite(station.measurement), fused.weight[s] > 0
        shares = {
            station.names[c]: float(1 - used[possible[:, c], c].mean())
            for c in station.components
            if possible[:, c].sum() >= FEWEST
        }
        if shares and used[possible].mean() < 1 - TOO_MANY_REJECTED:
            text = f"{station.name} contradicts the others: most of its readings are rejected; check its place, its "
            yield Remark(SUSPECT, text + "clock and its conventions, and that it follows the same target")
        if shares and min(shares.values()) > TOO_MANY_REJECTED:
            continue
        for name, share in shares.items():
            if share > MANY_REJECTED:
                level = UNRELIABLE if share > TOO_MANY_REJECTED else SUSPECT
                yield Remark(level, f"{100 * share:.0f} % of the {name} readings of {station.name} are rejected")


def _stretches(fused: Fused, zero_s: float) -> Iterator[Remark]:
    for each in stretches(fused):
        when = f"from {each.first_s + zero_s:.6g} to {each.last_s + zero_s:.6g} s"
        if each.kind != "another target":
            yield Remark(CONSISTENT, f"{each.station} {each.kind}: no reading {when}")
            continue
        others = [
            s for s, station in enumerate(fused.stations) if station.name != each.station and _carries(fused, s, each)
        ]
        if len(others) > 1:
            yield Remark(CONSISTENT, f"{each.station} follows another target {when}: all of its readings are rejected")
        else:
            other = fused.stations[others[0]].name if others else "no other station"
            text = (
                f"{each.station} and {other} contradict each other {when}, and nobody else saw the target: it is open "
            )
            yield Remark(SUSPECT, text + f"which is right; {each.station} is left out")


def _unchecked(fused: Fused, zero_s: float) -> Iterator[Remark]:
    """Where a component of a station that goes on is rejected, and what is left no more than determines the target."""
    times = [each.time_s - fused.constants.estimate[s, CLOCK] for s, each in enumerate(fused.stations)]
    for s, station in enumerate(fused.stations):
        for c in station.components:
            for ends in _long_runs(times[s], fused.possible[s][:, c], fused.weight[s][:, c]):
                left = [
                    k
                    for k, other in enumerate(fused.stations)
                    for each in other.components
                    if _mostly_used(fused, times[k], ends, k, each)
                ]
                if s in left and len(left) <= DETERMINED and ends[1] - ends[0] > UNCHECKED_S:
                    when = f"from {ends[0] + zero_s:.6g} to {ends[1] + zero_s:.6g} s"
                    text = f"the {station.names[c]} of {station.name} is rejected {when}, and no reading that is left "
                    yield Remark(SUSPECT, text + "checks its others: it may follow another target")


def _mostly_used(fused: Fused, time_s: FloatArray, ends: tuple[float, float], s: int, c: int) -> bool:
    """Whether most of a component's possible readings are used from one time to another."""
    here = (time_s >= ends[0]) & (time_s <= ends[1]) & (fused.possible[s][:, c] > 0)
    return bool(here.any() and (fused.weight[s][here, c] > 0).mean() > 0.5)


def _carries(fused: Fused, s: int, during: Stretch) -> bool:
    """Whether a station has readings that are used then."""
    time_s = fused.stations[s].time_s - fused.constants.estimate[s, CLOCK]
    here = (time_s >= during.first_s) & (time_s <= during.last_s)
    return bool((fused.weight[s][here] > 0).any())


def _poorly(fused: Fused, zero_s: float) -> Iterator[Remark]:
    found = consistency.poorly_observable(fused.track.time_s, fused.track.sigma[:, :3])
    for part in [each for each in found if each["to_s"] > each["from_s"]][:3]:  # the first of a filter is no stretch
        when = f"from {part['from_s'] + zero_s:.6g} to {part['to_s'] + zero_s:.6g} s"
        yield Remark(SUSPECT, f"the position is poorly observable {when}: 1 sigma up to {part['sigma_m']:.3g} m")


def _unsettled(fused: Fused) -> Iterator[Remark]:
    if fused.unexamined:
        yield cut_short(fused.unexamined)
    if not fused.settled:
        yield Remark(SUSPECT, "the decisions on outliers and the biases did not settle: inspect the flagged readings")
