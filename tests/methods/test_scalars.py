"""Heights beside elevations: better with them where elevation is poor, and never worse."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d, median_filter

from ftproc.core.impact import heights as above
from ftproc.files import decisions
from ftproc.methods import scalars
from ftproc.pipeline import filter_log
from ftproc.quality import summary
from ftproc.quality.statistics import NO_HEIGHTS
from ftproc.records import ACCEPTED, ENDS, MISSING, REJECTED, FloatArray, Heights, Line, MeasurementLog, Trajectory
from ftproc.settings import FilterSettings
from ftproc.simulation import Simulation, simulate

SMOOTH = FilterSettings(smooth=True)
STEP_M = 7.62  # 25 ft


@cache
def poor() -> tuple[Simulation, Trajectory]:
    """A radar whose elevations are 200 m wrong at 100 km, and what comes of them alone."""
    flight = simulate("radar", seed=6, noise=(30.0, 1e-3, 2e-3))
    return flight, filter_log(flight.log, SMOOTH)


def measured(flight: Simulation, sigma_m: float = 10.0, offset_m: float = 200.0) -> FloatArray:
    h = above(flight.truth.position_m)
    return h + offset_m + sigma_m * np.random.default_rng(1).standard_normal(len(h))


def with_heights(flight: Simulation, above_m: FloatArray, barometric: bool = False) -> MeasurementLog:
    return replace(flight.log, heights=Heights(above_m, barometric))


def errors(found: Trajectory, flight: Simulation) -> FloatArray:
    """RMSE of position, velocity, z and vz."""
    position, velocity = found.state[:, :3] - flight.truth.position_m, found.state[:, 3:6] - flight.truth.velocity_mps
    parts = (position, velocity, position[:, 2:], velocity[:, 2:])
    return np.array([np.sqrt((each**2).sum(1).mean()) for each in parts])


def inside(found: Trajectory, flight: Simulation) -> float:
    """Share of rows with z inside 3 sigma."""
    off = np.abs(found.state[:, 2] - flight.truth.position_m[:, 2])
    return float((off <= 3 * found.sigma[:, 2]).mean())


@pytest.mark.parametrize("smooth", [True, False])
def test_better_with_them(smooth: bool) -> None:
    flight, _ = poor()
    settings = FilterSettings(smooth=smooth)
    without = errors(filter_log(flight.log, settings), flight)
    found = filter_log(with_heights(flight, measured(flight)), settings)
    ratio = errors(found, flight) / without
    assert ratio[0] < 0.9
    assert ratio[1] < 0.95
    assert ratio[2:].max() < 0.45
    assert inside(found, flight) > 0.97
    part = found.metadata["summary"]["components"]["height"]
    assert part["noise_m"] == pytest.approx(10.0, rel=0.1)
    assert found.metadata["summary"]["trust"]["verdict"] == "consistent"
    assert "height" in summary.text(found.metadata)
    shown = found.diagnostics.beside["height"]
    left = (shown.residual / shown.residual_sigma)[50:]
    assert 0.8 < np.sqrt(np.nanmean(left**2)) < 1.2
    assert abs(np.median(shown.reading - shown.cleaned)) < 3.0


def test_the_offset_is_that_of_the_elevations() -> None:
    flight, without = poor()
    found = [filter_log(with_heights(flight, measured(flight, offset_m=off)), SMOOTH) for off in (-300.0, 300.0)]
    np.testing.assert_allclose(found[0].state, found[1].state, atol=0.5)
    assert "above those by the elevations" in " ".join(found[0].metadata["summary"]["remarks"])
    assert np.median(found[0].sigma[:, 2]) < 0.5 * np.median(without.sigma[:, 2])


def test_the_offset_is_in_the_sigmas(monkeypatch: pytest.MonkeyPatch) -> None:
    flight, _ = poor()
    log = with_heights(flight, measured(flight, 3.0))
    known = filter_log(log, SMOOTH).sigma[:, 2]
    monkeypatch.setattr(scalars, "OFFSET_M", 0.5)
    log = with_heights(flight, measured(flight, 3.0, 0.0))
    assert np.median(filter_log(log, SMOOTH).sigma[:, 2]) < 0.7 * np.median(known)


def test_the_scale_of_barometric_heights_is_found() -> None:
    flight, without = poor()
    h = measured(flight)
    warm = filter_log(with_heights(flight, 1.03 * h, barometric=True), SMOOTH)
    assert errors(warm, flight)[2] < 0.6 * errors(without, flight)[2]
    assert inside(warm, flight) > 0.97


def test_outliers_are_found() -> None:
    flight, without = poor()
    h, rng = measured(flight), np.random.default_rng(2)
    wrong = rng.random(len(h)) < 0.02
    h[wrong] += rng.choice([-1, 1], wrong.sum()) * rng.uniform(80, 2000, wrong.sum())
    found = filter_log(with_heights(flight, h), SMOOTH)
    label = np.asarray(found.extra.column("outlier_height"))
    assert np.isin(label[wrong], (1, 2)).all()
    assert np.isin(label[~wrong], (1, 2)).mean() < 0.002
    assert errors(found, flight)[2] < 0.45 * errors(without, flight)[2]


def test_rounded_ones_have_no_less_noise_than_the_steps() -> None:
    """Of many that are rounded to the same, each has that of all together."""
    flight, without = poor()
    found = filter_log(with_heights(flight, np.round(measured(flight, 0.0) / STEP_M) * STEP_M, barometric=True), SMOOTH)
    assert errors(found, flight)[2] < 0.5 * errors(without, flight)[2]
    assert inside(found, flight) > 0.97
    part = found.metadata["summary"]["components"]["height"]
    assert part["noise_m"] >= STEP_M / np.sqrt(12) - 1e-6
    assert found.metadata["summary"]["trust"]["verdict"] == "consistent"


def test_held_ones_count_once() -> None:
    """In a climb those that are held are late."""
    value = np.repeat(1000.0 + 37.0 * np.arange(20) + np.random.default_rng(1).standard_normal(20), 5)
    read, times = scalars._read_once(value)
    assert np.isfinite(read).sum() == 20
    assert (times == 1).all()
    rounded, times = scalars._read_once(np.repeat(STEP_M * np.arange(20), 5))
    assert np.isfinite(rounded).all()
    np.testing.assert_allclose(times, 5, rtol=0.35)
    _, times = scalars._read_once(np.repeat(np.r_[0.0, STEP_M, 0.0], (10, 200, 90)))
    assert (times[10:210] == 200).all()


def test_noise_across_the_steps_is_that_of_single_heights() -> None:
    """Those of the same height by chance were taken for one, and the others were too far off."""
    flight, _ = poor()
    found = filter_log(with_heights(flight, np.round(measured(flight, 4.0) / STEP_M) * STEP_M), SMOOTH)
    part = found.metadata["summary"]["components"]["height"]
    assert part["noise_m"] == pytest.approx(np.hypot(4.0, STEP_M / np.sqrt(12)), rel=0.1)
    assert 0.9 < part["innovation_ratio"] < 1.1


@pytest.mark.parametrize(
    ("what", "why"),
    [
        ("noisy", "the elevations tell the height better"),
        ("constant", "do not change"),
        ("another flight", "the heights"),
        ("feet", "the heights"),
        ("far", "km off"),
    ],
)
def test_useless_ones_change_nothing(what: str, why: str) -> None:
    flight, without = poor()
    h, t = measured(flight), flight.log.time_s
    column = {
        "noisy": measured(flight, 3000.0),
        "constant": np.full(len(h), 1000.0),
        "another flight": 3000 + 2000 * np.sin(t / 100),
        "feet": h / 0.3048,
        "far": h + 20_000.0,
    }[what]
    found = filter_log(with_heights(flight, column), SMOOTH)
    assert (errors(found, flight) / errors(without, flight)).max() <= 1.01
    assert "height" not in found.metadata["summary"]["components"]
    assert why in " ".join(found.metadata["summary"]["remarks"])


def test_precise_elevations_need_none() -> None:
    flight = simulate("overhead", seed=1)
    rounded = np.round(above(flight.truth.position_m) / STEP_M) * STEP_M
    ratio = errors(filter_log(with_heights(flight, rounded), SMOOTH), flight) / errors(
        filter_log(flight.log, SMOOTH), flight
    )
    assert ratio.max() <= 1.01


def test_where_elevations_are_missing_heights_go_on() -> None:
    flight, _ = poor()
    measurement = flight.log.measurement.copy()
    measurement[300:420, 2] = np.nan
    log = replace(flight.log, measurement=measurement)
    without = filter_log(log, SMOOTH)
    found = filter_log(replace(log, heights=Heights(measured(flight), False)), SMOOTH)
    off = [np.abs(each.state[300:420, 2] - flight.truth.position_m[300:420, 2]).max() for each in (without, found)]
    assert off[1] < 0.5 * off[0]


@pytest.mark.parametrize(
    "settings",
    [pytest.param({"editing": "live"}, marks=pytest.mark.slow), {"editing": "forward"}, {"method": "huber-ukf"}],
)
def test_where_they_are_not_used_the_run_says_so(settings: dict[str, str]) -> None:
    flight, _ = poor()
    found = filter_log(with_heights(flight, measured(flight)), FilterSettings(**settings))
    assert NO_HEIGHTS in found.metadata["summary"]["remarks"]
    np.testing.assert_array_equal(found.state, filter_log(flight.log, FilterSettings(**settings)).state)
    assert (np.asarray(found.extra.column("outlier_height")) == MISSING).all()


def test_decisions_by_hand() -> None:
    flight, _ = poor()
    h = measured(flight)
    h[100:103] += 500.0
    lines = (Line(2, "height", ENDS[1], 100, 102, "good"), Line(3, "height", ENDS[1], 200, 204, "bad"))
    log = decisions.Decisions("d.csv", "0", lines).applied(with_heights(flight, h))
    label = np.asarray(filter_log(log, SMOOTH).extra.column("outlier_height"))
    assert (label[np.isin(log.row, range(100, 103))] == ACCEPTED).all()
    assert (label[np.isin(log.row, range(200, 205))] == REJECTED).all()


def test_the_vertical_process_noise_follows_them() -> None:
    """Elevations that are poor show no climb begin, and what they allow for is too smooth for heights."""
    flight, without = poor()
    ratio = errors(filter_log(with_heights(flight, measured(flight, 3.0)), SMOOTH), flight) / errors(without, flight)
    assert ratio[2] < 0.1


def test_the_motion_over_the_ground_is_that_of_the_readings() -> None:
    """Fitted again with heights, it was 1.18 times as far off in velocity."""
    flight = simulate("radar", seed=9, noise=(30.0, 1e-3, 2e-3))
    found = filter_log(with_heights(flight, measured(flight, 3.0)), SMOOTH)
    assert (errors(found, flight) / errors(filter_log(flight.log, SMOOTH), flight)).max() < 1.01


def test_smoothed_elevations_that_pass_as_heights_do_no_harm() -> None:
    """Half of them were outliers, and z 2.1 times as far off with the others."""
    flight = simulate("radar", seed=1)
    r, _, e = flight.log.measurement.T
    z = r * np.sin(e)
    known = np.isfinite(z)
    z = np.interp(np.arange(len(z)), np.flatnonzero(known), z[known])
    off = np.abs(z - (middle := median_filter(z, 5)))
    column = gaussian_filter1d(np.where(off > 7 * np.median(off), middle, z), 5.0)
    found = filter_log(with_heights(flight, column), SMOOTH)
    assert (errors(found, flight) / errors(filter_log(flight.log, SMOOTH), flight)).max() < 1.01
