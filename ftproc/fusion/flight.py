"""From a range file to a fused flight: its trajectory, the stations' edited logs, the table of biases, the verdict."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ftproc import pipeline
from ftproc.core.identification.motions import motion_models, unseen_motion
from ftproc.core.impact import heights
from ftproc.core.model import kinematics
from ftproc.core.model.earth import Geodetic
from ftproc.derived import impact
from ftproc.derived.columns import with_derived
from ftproc.errors import InputError, UsageError
from ftproc.files import arrow
from ftproc.files.conventions import CONVENTION
from ftproc.files.decisions import Decisions
from ftproc.files.reading.formats import content
from ftproc.files.writing import geodesy
from ftproc.fusion import findings, logs, results
from ftproc.fusion.estimation import constants as posterior
from ftproc.fusion.estimation import engine, whole
from ftproc.fusion.estimation.constants import Constants
from ftproc.fusion.estimation.whole import Fused
from ftproc.fusion.range_file import Instrument, Range
from ftproc.methods import preparing
from ftproc.quality import by_hand, provenance, statistics, verdict
from ftproc.records import MeasurementLog, Trajectory
from ftproc.settings import FilterSettings

if TYPE_CHECKING:
    import pyarrow as pa

    from ftproc.correction.model import Model

METHOD = "fusion"


@dataclass(frozen=True)
class Flight:
    """trajectory: x east, y north, z up at the origin, with the summary in its metadata. edited: a table for each
    station. biases: the table. constants: the same as numbers. fused: what the report draws; None of one station."""

    trajectory: Trajectory
    edited: dict[str, pa.Table]
    biases: pa.Table
    constants: Constants
    fused: Fused | None = None
    zero_s: float = 0.0


def _unheard(done: int, most: int) -> None:
    """Progress that nobody asked for."""


def fuse(
    range_: Range,
    settings: FilterSettings,
    model: Model | None = None,
    say: Callable[[int, int], None] = _unheard,
    decisions: Decisions | None = None,
) -> Flight:
    """The flight that the stations of a range have seen. model: the correction of a single station's filter. decisions:
    by hand, on the readings of the stations.

    Raises InputError for logs that cannot be read or have nothing in common, UsageError for settings without sense.
    """
    range_, read = logs.read(range_, decisions)
    if len(read) == 1:
        return _alone(range_, read[0], settings, model)
    seen, zero_s = logs.as_seen(range_.instruments, read, range_.origin)
    logs.check_overlap(range_, seen)
    try:
        among = preparing.motions(settings, range_.origin)
        fused = whole.fuse(seen, settings.gate, settings.jerk_psd_m2ps5, settings.smooth, say, among)
    except engine.Alone as cause:
        names = ", ".join(station.name for station in seen)
        raise InputError(
            f"{range_.path}: the readings of {names} meet nowhere, so there is no first track: at no time do a range "
            "and two angles, two lines of sight, or three ranges meet in a point. Check the places, the clocks and the "
            "conventions of the stations, or add one."
        ) from cause
    return _flight(range_, read, fused, zero_s, settings, by_hand.Effects(decisions, settings.gate))


def _flight(
    range_: Range,
    read: Sequence[MeasurementLog],
    fused: Fused,
    zero_s: float,
    settings: FilterSettings,
    effects: by_hand.Effects,
) -> Flight:
    track = fused.track
    if not np.isfinite(track.state).all():
        raise InputError(f"{range_.path}: the fused filter diverged; check the places, the clocks and the conventions.")
    names = [station.name for station in fused.stations]
    edited = {name: results.edited(fused, s, read[s], range_.instruments[s]) for s, name in enumerate(names)}
    for s, (log, table) in enumerate(zip(read, edited.values(), strict=True)):
        effects.add(log.by_hand, *results.residuals(table, log, fused.noise[s]))
    assumed = [
        f"{name}: {each}" for name, log in zip(names, read, strict=True) for each in log.understood.get("assumed", ())
    ]
    summary = summarize(fused, zero_s, effects, assumed)
    summary |= _impact(fused, float(track.time_s[-1]) + zero_s, range_.origin)
    metadata = {**_metadata(range_, read, settings, summary, fused), "epoch": logs.epoch(read), **effects.metadata()}
    n = len(track.time_s)
    falls = fused.last is not None
    sigma, _ = unseen_motion.widened(track.state, track.sigma, np.full((n, 6), np.nan), falls)
    path_sigma = kinematics.widened(track.state, track.path_sigma, track.sigma, sigma)
    trajectory = Trajectory(
        range_.path, np.arange(n), track.time_s + zero_s, np.full((n, 3), np.nan), track.state, sigma,
        np.full((n, 3), np.nan), np.zeros((n, 3), np.uint8), track.nis, np.zeros((n, 6)), metadata,
        arrow.table({"stations": results.stations_used(fused).astype(np.int64)}), path_sigma=path_sigma,
    )  # fmt: skip
    located = _located(trajectory, range_, settings)
    return Flight(located, edited, results.biases(fused.constants, names), fused.constants, fused, zero_s)


def _located(trajectory: Trajectory, range_: Range, settings: FilterSettings) -> Trajectory:
    """With positions on the earth, if the origin is there and the library too, and derived quantities."""
    if range_.origin is not None:
        with contextlib.suppress(UsageError):  # without the library
            geodesy.require_pymap3d()
            trajectory = geodesy.located(trajectory, replace(settings, site=range_.origin))
    return with_derived(trajectory, settings)


def _alone(range_: Range, log: MeasurementLog, settings: FilterSettings, model: Model | None) -> Flight:
    """A single station: filtered as any log, and seen from the origin."""
    instrument = range_.instruments[0]
    own = instrument.recipe.settings
    both = {name: getattr(settings, name) or getattr(own, name) for name in ("noise", "height", "jerk_psd_m2ps5")}
    settings = replace(settings, **both)
    found = pipeline.filter_log(log, settings, model)
    turned = _from_origin(found, instrument, log.frame)
    (seen,), _ = logs.as_seen(range_.instruments, [log])
    constants = Constants.before(seen.prior[None])
    used = (found.outlier == 0).any(1).astype(np.int64)
    last = whole.distinct(found.time_s)
    summary = {
        **found.metadata["summary"],
        "log": range_.path,
        "stations": {instrument.name: {"log": log.name}},
    }
    here = {"log": log.name, "log_sha256": log.sha256 or None}
    metadata = {
        **found.metadata, "method": METHOD, "log": range_.path, "log_sha256": _digest(range_), "frame": "local",
        "stations": {instrument.name: here}, "summary": summary,
    }  # fmt: skip
    trajectory = replace(
        turned, name=range_.path, row=np.arange(len(last)), time_s=found.time_s[last], state=turned.state[last],
        sigma=turned.sigma[last], measurement=np.full((len(last), 3), np.nan),
        measurement_sigma=np.full((len(last), 3), np.nan),
        outlier=np.zeros((len(last), 3), np.uint8), nis=found.nis[last], correction=np.zeros((len(last), 6)),
        metadata=metadata, extra=arrow.table({"stations": used[last]}), diagnostics=None,
        path_sigma=None if found.path_sigma is None else found.path_sigma[last],
    )  # fmt: skip
    edited = {instrument.name: results.edited_alone(found, log)}
    table = results.biases(constants, [instrument.name])
    return Flight(_located(trajectory, range_, settings), edited, table, constants)


def _from_origin(found: Trajectory, instrument: Instrument, frame: str) -> Trajectory:
    """A station's own trajectory in east, north and up of the origin."""
    order = [1, 0, 2] if frame == "north-east-up" else [0, 1, 2]
    back = instrument.axes.T
    level = bool((back == np.eye(3)).all())
    state, sigma = found.state.copy(), found.sigma.copy()
    for at in (0, 3, 6):
        own = found.state[:, at : at + 3][:, order]
        state[:, at : at + 3] = own if level else own @ back.T
    state[:, :3] += instrument.place
    for at in (0, 3, 6):
        own = found.sigma[:, at : at + 3][:, order]
        sigma[:, at : at + 3] = own if level else np.sqrt(own**2 @ (back.T) ** 2)
    return replace(found, state=state, sigma=sigma)


def summarize(fused: Fused, zero_s: float, effects: by_hand.Effects, assumed: Sequence[str] = ()) -> dict[str, Any]:
    """The figures of a fused flight, JSON-serialisable; times as in the logs. effects: of the decisions by hand.
    assumed: what nothing states of the logs."""
    time_s, jerk = fused.track.time_s, fused.jerk.mean(1)
    said = [*findings.remarks(fused, zero_s), *verdict.by_hand_remarks(effects.summary())]
    trust = verdict.verdict(said, assumed=assumed)
    if verdict.level_of(trust) == verdict.CONSISTENT:
        trust["not_shown"] = findings.NOT_SHOWN
    return {
        "rows": len(time_s),
        "readings": int(sum((possible > 0).sum() for possible in fused.possible)),
        "duration_s": float(time_s[-1] - time_s[0]),
        "stations": {
            station.name: {
                "rows": len(station.time_s),
                "components": findings.component_figures(fused, s),
                "biases": _bias_figures(fused.constants, s),
            }
            for s, station in enumerate(fused.stations)
        },
        "stretches": [
            {"station": e.station, "from_s": e.first_s + zero_s, "to_s": e.last_s + zero_s, "what": e.kind}
            for e in findings.stretches(fused)
        ],
        "cannot_be_told": posterior.not_observable(fused.constants, [station.name for station in fused.stations]),
        "jerk_psd_m2ps5": {"lowest": jerk.min(), "median": float(np.median(jerk)), "highest": jerk.max()},
        **_motion(fused),
        "rounds": fused.rounds,
        "editing_converged": fused.settled,
        "notes": [remark.text for remark in said if remark.text not in trust["reasons"]],
        "trust": trust,
        **effects.summary(),
    }


def _motion(fused: Fused) -> dict[str, Any]:
    """The motion that was chosen for most rows, as in the summary of a single log."""
    rows = dict[str, int]()
    for motion, there in fused.motions:
        rows[motion.name] = rows.get(motion.name, 0) + there
    abrupt_s = [each for motion, _ in fused.motions for each in motion.abrupt_s]
    return statistics.motion(rows, sum(motion.gain for motion, _ in fused.motions), abrupt_s)


def _impact(fused: Fused, last_s: float, site: Geodetic | None) -> dict[str, Any]:
    """The end of a ballistic flight, for the summary."""
    if fused.last is None:
        return {}
    lowest_m = float((heights(fused.track.state[:, :3]) + fused.track.sigma[:, 2]).min())
    here = {"stations": True, "settings": {"site": site}}
    return impact.of_flight(*fused.last, lowest_m, last_s, here)


def _acts(fused: Fused) -> bool:
    """Whether the first axis of the process noise goes along the path."""
    return any(motion.name != motion_models.WHITE for motion, _ in fused.motions)


def _digest(range_: Range) -> str | None:
    """The SHA-256 of the range file."""
    return content.sha256(Path(range_.path)) or None


def _bias_figures(constants: Constants, s: int) -> dict[str, Any]:
    return {
        name: {
            "estimate": float(constants.estimate[s, j]),
            "sigma": float(constants.sigma[s, j]),
            "prior_sigma": float(constants.prior[s, j]),
            "observable": bool(constants.observable[s, j]),
        }
        for j, name in enumerate(posterior.NAMES)
        if constants.prior[s, j] > 0
    }


def _metadata(
    range_: Range, read: Sequence[MeasurementLog], settings: FilterSettings, summary: dict[str, Any], fused: Fused
) -> dict[str, Any]:
    return {
        **provenance.begun(),
        "method": METHOD,
        "log": range_.path,
        "log_sha256": _digest(range_),
        "frame": "local",
        "axes": "x east, y north, z up at the origin of the range; time is true time: clock offsets are taken out",
        "convention": CONVENTION["local"],
        "origin": range_.origin,
        "stations": {
            each.name: {
                "log": each.log,
                "log_sha256": log.sha256 or None,
                "place_m": each.place.tolist(),
                "site": each.site,
            }
            for each, log in zip(range_.instruments, read, strict=True)
        },
        "settings": {
            "editing": "two-pass",
            "smooth": settings.smooth,
            "gate": settings.gate,
            "motion": settings.motion,
            "site": range_.origin,
            "jerk_specified": settings.jerk_psd_m2ps5 is not None,
            "jerk_psd_m2ps5": settings.jerk_psd_m2ps5,
        },
        "motion": summary["motion"],
        "motion_gain": summary["motion_gain"],
        "sees": "the whole record",
        "model_sha256": None,
        "summary": summary,
        "jerk_profile": provenance.jerk_profile(fused.jerk, fused.knot_s, _acts(fused)),
    }
