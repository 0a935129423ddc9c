"""The figures of merit of one trajectory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ftproc.core.model.frames import from_cartesian, wrap
from ftproc.derived import impact
from ftproc.errors import InputError
from ftproc.records import COMPONENTS, ISOLATED, MISSING, PATCH, REJECTED, FlagArray, FloatArray, Trajectory, Truth
from ftproc.scoring import named
from ftproc.scoring.differences import Difference
from ftproc.scoring.matching import MatchedTruth, match
from ftproc.scoring.named import Spread
from ftproc.scoring.sigmas import Consistency, consistency, in_words

#: Quantities of the state: how the whole and its axes are named in the figures, and their unit.
_STATE = {
    "position": ("3d", ("x", "y", "z"), "m"),
    "velocity": ("v", ("vx", "vy", "vz"), "mps"),
    "acceleration": ("a", ("ax", "ay", "az"), "mps2"),
}
#: Errors of which `path` has bias and spread.
_SIDES = [f"{q} {side}" for q in ("position", "velocity") for side in (*named.SIDES, "horizontal")]


@dataclass(frozen=True)
class Gradient:
    """Average gradient F per component: mean change from sample to sample, the azimuth's wrapped.

    Zuo et al. 2021 eq. 18. NaN where fewer than two consecutive samples have a value. F measures motion as
    well as noise: compare it with that of the truth.
    """

    range_m: float
    azimuth_rad: float
    elevation_rad: float


@dataclass(frozen=True)
class Detection:
    """Outliers found in one component: flagged isolated, patch or rejected by hand, against those of the truth.

    Counted over the samples that the truth has too; readings marked missing are left out. A ratio over zero is NaN.
    false_alarm_rate: share of the good readings that were flagged.
    """

    precision: float
    recall: float
    f1: float
    false_alarm_rate: float
    true_positives: int
    false_positives: int
    false_negatives: int
    true_negatives: int


@dataclass(frozen=True, repr=False)
class Score:
    """The result of `score`; all from `truth` to `outliers` needs a truth and is None without one.

    sees: readings that the estimates use (past ones, or the whole record); smoothed: by --smooth; both None when the
    file does not say. samples: rows of the trajectory. matched, interpolated, unmatched: number of these with a truth
    at the same time, between two of its times, or none. without_estimate: matched or interpolated, but without a
    position. rmse_seed_m: mean over the samples of the norm of the position error (Zuo et al. 2021 eq. 20 and 21,
    called RMSE there). rmse_3d_m, rmse_x_m ...: root mean square, in 3-D and per axis; rmse_v_mps ..., rmse_a_mps2 ...:
    of velocity and acceleration, None if the truth has none; rmse_range_m ...: of the cleaned readings, against range,
    azimuth and elevation of the truth from the station. max_error_m, p95_error_m, p99_error_m: of the norm of the
    position error. position, velocity, acceleration, cleaned: whether their published sigmas hold; None where nothing
    is published, or the truth has none. path: bias and spread along track, across and vertical, of position and
    velocity, by name and unit (`position_along_m`); channels: the same of the cleaned readings (`azimuth_rad`); see
    `named`. in_3sigma, nees_position: two of the position's. sigma_verdict: all of these
    in words. difference: of a second of two trajectories from the first; require: each limit with what was found. NaN
    where nothing could be counted.
    """

    trajectory: str
    method: str | None
    samples: int
    average_gradient: Gradient
    truth: str | None = None
    matched: int | None = None
    interpolated: int | None = None
    unmatched: int | None = None
    without_estimate: int | None = None
    truth_average_gradient: Gradient | None = None
    rmse_seed_m: float | None = None
    rmse_3d_m: float | None = None
    rmse_x_m: float | None = None
    rmse_y_m: float | None = None
    rmse_z_m: float | None = None
    rmse_v_mps: float | None = None
    rmse_vx_mps: float | None = None
    rmse_vy_mps: float | None = None
    rmse_vz_mps: float | None = None
    rmse_a_mps2: float | None = None
    rmse_ax_mps2: float | None = None
    rmse_ay_mps2: float | None = None
    rmse_az_mps2: float | None = None
    rmse_range_m: float | None = None
    rmse_azimuth_rad: float | None = None
    rmse_elevation_rad: float | None = None
    max_error_m: float | None = None
    p95_error_m: float | None = None
    p99_error_m: float | None = None
    in_3sigma: float | None = None
    nees_position: float | None = None
    position: Consistency | None = None
    velocity: Consistency | None = None
    acceleration: Consistency | None = None
    cleaned: Consistency | None = None
    path: dict[str, Spread] | None = None
    channels: dict[str, Spread] | None = None
    sigma_verdict: str | None = None
    outliers: dict[str, Detection] | None = None
    sees: str | None = None
    smoothed: bool | None = None
    difference: Difference | None = None
    require: list[dict[str, Any]] | None = None
    impact: dict[str, Any] | None = None

    def __repr__(self) -> str:
        errors = (("position RMSE", self.rmse_3d_m, "m"), ("velocity RMSE", self.rmse_v_mps, "m/s"))
        known = [f"{what} {value:.4g} {unit}" for what, value, unit in errors if value is not None]
        sigmas = [f"sigmas {self.sigma_verdict}"] if self.sigma_verdict else []
        return f"<Score of {self.trajectory}: {', '.join([f'{self.samples} samples', *known, *sigmas])}>"

    def as_dict(self) -> dict[str, Any]:
        """Nested and JSON-serialisable: what is unknown is left out, what could not be computed is None."""
        return _plain(asdict(self))


def score(trajectory: Trajectory, truth: Truth | None = None) -> Score:
    """Figures of merit of a trajectory: its average gradient, and against a truth its errors and flags.

    The truth is matched by time (see `matching.match`), never extrapolated. Its own average gradient is
    taken at the matched samples, so that the two are comparable. Raises InputError if their times do not overlap.
    """
    method, sees = trajectory.metadata.get("method"), trajectory.metadata.get("sees")
    settings = trajectory.metadata.get("settings")
    smoothed = settings.get("smooth") if isinstance(settings, Mapping) else None
    known: dict[str, Any] = {
        "trajectory": trajectory.name,
        "method": method if isinstance(method, str) else None,
        "sees": sees if isinstance(sees, str) else None,
        "smoothed": smoothed if isinstance(smoothed, bool) else None,
        "samples": len(trajectory),
        "average_gradient": average_gradient(trajectory.measurement),
    }
    summary = trajectory.metadata.get("summary")
    predicted = summary.get("impact") if isinstance(summary, Mapping) else None
    if isinstance(predicted, Mapping):
        known["impact"] = impact.against(predicted, truth)
    if truth is not None:
        known |= _against(trajectory, truth)
    return Score(**known)


def average_gradient(measurement: FloatArray) -> Gradient:
    """Zuo et al. 2021 eq. 18 for (n, 3) range m, azimuth rad, elevation rad in time order.

    Pairs with a missing value are left out of the mean.
    """
    return Gradient(*(_mean(column) for column in changes(measurement).T))


def changes(measurement: FloatArray) -> FloatArray:
    """(n - 1, 3) size of the change from sample to sample of (n, 3) readings, that of the azimuth wrapped."""
    step = np.diff(measurement, axis=0)
    step[:, 1] = wrap(step[:, 1])
    return np.abs(step)


def _against(trajectory: Trajectory, truth: Truth) -> dict[str, Any]:
    found = match(trajectory.time_s, truth)
    there = np.isfinite(found.position_m).all(axis=1)
    known_s = truth.time_s[np.isfinite(truth.position_m).all(axis=1)]
    if len(trajectory) and len(known_s) and not there.any():
        ours, theirs = (f"{t.min():.10g} s to {t.max():.10g} s" for t in (trajectory.time_s, known_s))
        raise InputError(
            f"{truth.name}: its times, {theirs}, do not overlap those of {trajectory.name}, {ours}. "
            "Name the truth of this flight, or bring both to the same clock."
        )
    error = trajectory.state[:, :3] - found.position_m
    usable = np.isfinite(error).all(axis=1)
    known: dict[str, Any] = {
        "truth": truth.name,
        "matched": int((there & ~found.interpolated).sum()),
        "interpolated": int(found.interpolated.sum()),
        "unmatched": int((~there).sum()),
        "without_estimate": int((there & ~usable).sum()),
        "truth_average_gradient": average_gradient(from_cartesian(found.position_m)),
    }
    known |= _position_figures(error[usable]) | _errors(trajectory, found)
    position = known["position"]
    known["in_3sigma"] = np.nan if position is None else position.share_in_3_sigma
    known["nees_position"] = np.nan if position is None else position.nees
    if found.outlier is not None:
        known["outliers"] = {
            name: _detection(trajectory.outlier[found.exact, c], found.outlier[found.exact, c])
            for c, name in enumerate(COMPONENTS)
        }
    return known


def _position_figures(error: FloatArray) -> dict[str, float]:
    """From (m, 3) errors in m."""
    norm = np.sqrt(np.sum(error**2, axis=1))
    return {
        "rmse_seed_m": _mean(norm),
        "max_error_m": float(norm.max()) if len(norm) else np.nan,
        "p95_error_m": float(np.percentile(norm, 95)) if len(norm) else np.nan,
        "p99_error_m": float(np.percentile(norm, 99)) if len(norm) else np.nan,
    }


def _errors(trajectory: Trajectory, truth: MatchedTruth) -> dict[str, Any]:
    """RMSE and consistency of position, velocity and acceleration, as far as the truth has them, and of the cleaned
    readings, as far as the trajectory has them."""
    known: dict[str, Any] = {}
    errors = named.errors(trajectory, truth)
    for k, (quantity, (whole, axes, unit)) in enumerate(_STATE.items()):
        if quantity not in errors:
            continue
        error = named.vector(errors, quantity)
        known[f"rmse_{whole}_{unit}"] = _rms(errors[quantity])
        known |= {f"rmse_{axis}_{unit}": _rms(column) for axis, column in zip(axes, error.T, strict=True)}
        sigma = trajectory.sigma[:, 3 * k : 3 * k + 3]
        known[quantity] = consistency(trajectory.time_s, named.in_sigmas(error, sigma), axes)
    cleaned, ratio = named.of_readings(errors, trajectory)
    known |= {f"rmse_{name}_{named.unit(name)}": _rms(errors[name]) for name in cleaned}
    known["cleaned"] = consistency(trajectory.time_s, ratio, cleaned) if cleaned else None
    known |= {"path": _spreads(errors, _SIDES), "channels": _spreads(errors, COMPONENTS)}
    judged = [known[quantity] for quantity in (*_STATE, "cleaned") if known.get(quantity) is not None]
    return known | {"sigma_verdict": in_words(judged)}


def _spreads(errors: Mapping[str, FloatArray], names: Sequence[str]) -> dict[str, Spread]:
    """Bias and spread of the errors of these names, as far as they are known, by name and unit."""
    found = {name: Spread.of(errors[name]) for name in names if name in errors}
    return {f"{name.replace(' ', '_')}_{named.unit(name)}": each for name, each in found.items() if each is not None}


def _detection(flag: FlagArray, injected: FlagArray) -> Detection:
    """From the (m,) flags of one component and the codes of its injected outliers."""
    measured = flag != MISSING
    found, bad = np.isin(flag[measured], (ISOLATED, PATCH, REJECTED)), injected[measured] != 0
    tp, fp = int((found & bad).sum()), int((found & ~bad).sum())
    fn, tn = int((~found & bad).sum()), int((~found & ~bad).sum())
    return Detection(
        precision=_ratio(tp, tp + fp),
        recall=_ratio(tp, tp + fn),
        f1=_ratio(2 * tp, 2 * tp + fp + fn),
        false_alarm_rate=_ratio(fp, fp + tn),
        true_positives=tp,
        false_positives=fp,
        false_negatives=fn,
        true_negatives=tn,
    )


def _ratio(part: int, whole: int) -> float:
    return part / whole if whole else float("nan")


def _mean(values: FloatArray | NDArray[np.bool_]) -> float:
    """Mean of the finite values; NaN without any."""
    finite = values[np.isfinite(values)]
    return float(np.mean(finite)) if len(finite) else float("nan")


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(_mean(values**2)))


def _plain(value: dict[str, Any]) -> dict[str, Any]:
    """Without None, and None for what is not finite."""
    plain: dict[str, Any] = {}
    for name, inner in value.items():
        if isinstance(inner, dict):
            plain[name] = _plain(inner)
        elif inner is not None:
            plain[name] = None if isinstance(inner, float) and not np.isfinite(inner) else inner
    return plain
