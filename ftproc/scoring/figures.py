"""The figures of merit of one trajectory."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ftproc.core.model.frames import from_cartesian, wrap
from ftproc.errors import InputError
from ftproc.records import COMPONENTS, ISOLATED, PATCH, FlagArray, FloatArray, Trajectory, Truth
from ftproc.scoring.matching import match

NEES_BOUNDS = (1.0, 5.0)  # of the mean over a flight, for consistent sigmas; 3 is expected
LEAST_IN_3SIGMA = 0.97


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
    """Outliers found in one component: flagged isolated or patch by the trajectory, against those of the truth.

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


@dataclass(frozen=True)
class Score:
    """The result of `score`; all from `truth` to `outliers` needs a truth and is None without one.

    sees: readings that the estimates use (past ones, or the whole record); smoothed: by --smooth; both None when the
    file does not say. samples: rows of the trajectory. matched, interpolated, unmatched: number of these with a truth
    at the same time, between two of its times, or none. without_estimate: matched or interpolated, but without a
    position. rmse_seed_m: mean over the samples of the norm of the position error (Zuo et al. 2021 eq. 20 and 21,
    called RMSE there). rmse_3d_m, rmse_x_m ...: root mean square, in 3-D and per axis; rmse_v_mps ...: of the velocity,
    None if the truth has none. max_error_m, p95_error_m, p99_error_m: of the norm of the position error. in_3sigma:
    share of samples with all three axes inside 3 published sigmas (0.992 if these are consistent and independent).
    nees_position: mean of the sum of (error / published sigma)^2 over the three axes, 3 when the sigmas are consistent;
    correlations between the axes are not published and so not used. sigma_verdict: these two in words. NaN where
    nothing could be counted.
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
    max_error_m: float | None = None
    p95_error_m: float | None = None
    p99_error_m: float | None = None
    in_3sigma: float | None = None
    nees_position: float | None = None
    sigma_verdict: str | None = None
    outliers: dict[str, Detection] | None = None
    sees: str | None = None
    smoothed: bool | None = None

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
    known |= _position_figures(error[usable], trajectory.sigma[usable, :3])
    if found.velocity_mps is not None:
        known |= _velocity_figures(trajectory.state[:, 3:6] - found.velocity_mps)
    if found.outlier is not None:
        known["outliers"] = {
            name: _detection(trajectory.outlier[found.exact, c], found.outlier[found.exact, c])
            for c, name in enumerate(COMPONENTS)
        }
    return known


def _position_figures(error: FloatArray, sigma: FloatArray) -> dict[str, float | str | None]:
    """From (m, 3) errors and published sigmas in m."""
    norm = np.sqrt(np.sum(error**2, axis=1))
    published = np.isfinite(sigma).all(axis=1) & (sigma > 0).all(axis=1)
    ratio = error[published] / sigma[published]
    x, y, z = (_rms(column) for column in error.T)
    return {
        "rmse_seed_m": _mean(norm),
        "rmse_3d_m": _rms(norm),
        "rmse_x_m": x,
        "rmse_y_m": y,
        "rmse_z_m": z,
        "max_error_m": float(norm.max()) if len(norm) else np.nan,
        "p95_error_m": float(np.percentile(norm, 95)) if len(norm) else np.nan,
        "p99_error_m": float(np.percentile(norm, 99)) if len(norm) else np.nan,
        "in_3sigma": _mean(np.all(np.abs(ratio) <= 3, axis=1)),
        "nees_position": _mean(np.sum(ratio**2, axis=1)),
        "sigma_verdict": sigma_verdict(ratio),
    }


def sigma_verdict(ratio: FloatArray) -> str | None:
    """In words, from (m, 3) errors over their published sigmas: `consistent`, `cautious`, or `overconfident in x`.

    Errors of neighbouring samples are correlated, so the chi-square bounds of independent ones would be far too narrow;
    these bounds suit a flight of a few minutes.
    """
    if not len(ratio):
        return None
    by_axis = np.mean(ratio**2, axis=0)
    if by_axis.sum() > NEES_BOUNDS[1] or np.mean(np.all(np.abs(ratio) <= 3, axis=1)) < LEAST_IN_3SIGMA:
        named = [axis for axis, size in zip("xyz", by_axis, strict=True) if size >= 0.8 * by_axis.max()]
        return f"overconfident in {', '.join(named)}"
    return "cautious" if by_axis.sum() < NEES_BOUNDS[0] else "consistent"


def _velocity_figures(error: FloatArray) -> dict[str, float]:
    """From (n, 3) velocity errors in m/s, NaN where either is missing."""
    error = error[np.isfinite(error).all(axis=1)]
    x, y, z = (_rms(column) for column in error.T)
    return {
        "rmse_v_mps": _rms(np.sqrt(np.sum(error**2, axis=1))),
        "rmse_vx_mps": x,
        "rmse_vy_mps": y,
        "rmse_vz_mps": z,
    }


def _detection(flag: FlagArray, injected: FlagArray) -> Detection:
    """From the (m,) flags of one component and the codes of its injected outliers."""
    measured = flag <= PATCH
    found, bad = np.isin(flag[measured], (ISOLATED, PATCH)), injected[measured] != 0
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
