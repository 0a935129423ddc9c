"""Scores: every figure against the same thing computed in plain Python loops."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ftproc.core.model.frames import from_cartesian
from ftproc.records import FloatArray, Trajectory, Truth
from ftproc.scoring import render, score
from ftproc.simulation import simulate
from tests.simulated import flown, trajectory_for


def naive_gradient(measurement: FloatArray) -> dict[str, float]:
    names = ("range_m", "azimuth_rad", "elevation_rad")
    result = {}
    for c, name in enumerate(names):
        steps = []
        for k in range(len(measurement) - 1):
            step = measurement[k + 1][c] - measurement[k][c]
            if c == 1:
                while step >= math.pi:
                    step -= 2 * math.pi
                while step < -math.pi:
                    step += 2 * math.pi
            if not math.isnan(step):
                steps.append(abs(step))
        result[name] = sum(steps) / len(steps) if steps else math.nan
    return result


def naive_rms(values: list[float]) -> float:
    return math.sqrt(sum(v * v for v in values) / len(values))


def naive_percentile(values: list[float], share: float) -> float:
    values = sorted(values)
    place = share * (len(values) - 1)
    low = math.floor(place)
    high = min(low + 1, len(values) - 1)
    return values[low] + (place - low) * (values[high] - values[low])


def naive_score(t: Trajectory, truth: Truth) -> dict[str, float]:
    """All position and velocity figures for a truth with the trajectory's own times, row for row."""
    assert truth.velocity_mps is not None
    norms, axes, velocity, inside, nees = [], ([], [], []), ([], [], []), [], []  # type: ignore[var-annotated]
    for k in range(len(t)):
        e = [t.state[k][i] - truth.position_m[k][i] for i in range(3)]
        if any(math.isnan(x) for x in e):
            continue
        norms.append(math.sqrt(e[0] ** 2 + e[1] ** 2 + e[2] ** 2))
        for i in range(3):
            axes[i].append(e[i])
            velocity[i].append(t.state[k][3 + i] - truth.velocity_mps[k][i])
        inside.append(all(abs(e[i]) <= 3 * t.sigma[k][i] for i in range(3)))
        nees.append(sum((e[i] / t.sigma[k][i]) ** 2 for i in range(3)))
    speed = [math.sqrt(x * x + y * y + z * z) for x, y, z in zip(*velocity, strict=True)]
    return {
        "rmse_seed_m": sum(norms) / len(norms),
        "rmse_3d_m": naive_rms(norms),
        "rmse_x_m": naive_rms(axes[0]),
        "rmse_y_m": naive_rms(axes[1]),
        "rmse_z_m": naive_rms(axes[2]),
        "rmse_v_mps": naive_rms(speed),
        "rmse_vx_mps": naive_rms(velocity[0]),
        "rmse_vy_mps": naive_rms(velocity[1]),
        "rmse_vz_mps": naive_rms(velocity[2]),
        "max_error_m": max(norms),
        "p95_error_m": naive_percentile(norms, 0.95),
        "p99_error_m": naive_percentile(norms, 0.99),
        "in_3sigma": sum(inside) / len(inside),
        "nees_position": sum(nees) / len(nees),
    }


def naive_detection(flags: list[int], injected: list[int]) -> dict[str, float]:
    tp = fp = fn = tn = 0
    for flag, code in zip(flags, injected, strict=True):
        if flag == 3:
            continue
        if flag in (1, 2):
            tp, fp = (tp + 1, fp) if code else (tp, fp + 1)
        else:
            fn, tn = (fn + 1, tn) if code else (fn, tn + 1)
    precision = tp / (tp + fp) if tp + fp else math.nan
    recall = tp / (tp + fn) if tp + fn else math.nan
    f1 = math.nan
    if tp + fp + fn:
        f1 = 2 * precision * recall / (precision + recall) if tp else 0.0
    return {
        "precision": precision,
        "recall": recall,
        "f1": f1,
        "false_alarm_rate": fp / (fp + tn) if fp + tn else math.nan,
        "true_positives": tp,
        "false_positives": fp,
        "false_negatives": fn,
        "true_negatives": tn,
    }


@pytest.mark.parametrize("seed", range(5))
def test_every_figure_equals_the_naive_one(seed: int) -> None:
    truth = flown(seed, outliers="isolated=0.1")
    t = trajectory_for(truth, seed)
    found = score(t, truth)
    assert found.samples == found.matched == len(t) == 201
    assert found.without_estimate == int(np.isnan(t.state[:, 0]).sum()) > 0
    assert found.unmatched == found.interpolated == 0
    for name, value in naive_score(t, truth).items():
        assert getattr(found, name) == pytest.approx(value, rel=1e-12), name
    for gradient, measurement in (
        (found.average_gradient, t.measurement),
        (found.truth_average_gradient, from_cartesian(truth.position_m)),
    ):
        for name, value in naive_gradient(measurement).items():
            assert getattr(gradient, name) == pytest.approx(value, rel=1e-9), name
    assert truth.outlier is not None
    assert found.outliers is not None
    for c, component in enumerate(("range", "azimuth", "elevation")):
        naive = naive_detection(t.outlier[:, c].tolist(), truth.outlier[:, c].tolist())
        for name, value in naive.items():
            assert getattr(found.outliers[component], name) == pytest.approx(value, nan_ok=True), name


@given(st.lists(st.tuples(st.integers(0, 3), st.integers(0, 7)), max_size=12))
def test_detection_equals_the_naive_one_with_few_samples(pairs: list[tuple[int, int]]) -> None:
    n = len(pairs)
    flags, injected = [a for a, _ in pairs], [b for _, b in pairs]
    truth = Truth("t", np.arange(float(n)), np.ones((n, 3)), outlier=np.array([injected] * 3, np.uint8).T)
    t = trajectory_for(truth, outlier=np.array([flags] * 3, np.uint8).T)
    found = score(t, truth).outliers
    assert found is not None
    for name, value in naive_detection(flags, injected).items():
        assert getattr(found["azimuth"], name) == pytest.approx(value, nan_ok=True), name


def test_known_errors_give_known_figures() -> None:
    """3, 4 and 0 m off in x, y, z everywhere; sigma 1, 2, 1 m; 2 m/s off in z."""
    truth = flown()
    assert truth.velocity_mps is not None
    state = np.zeros((len(truth), 9))
    state[:, :3] = truth.position_m + np.array([3.0, 4.0, 0.0])
    state[:, 3:6] = truth.velocity_mps + np.array([0.0, 0.0, 2.0])
    sigma = np.tile([1.0, 2.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0], (len(truth), 1))
    found = score(trajectory_for(truth, state=state, sigma=sigma), truth)
    assert found.rmse_seed_m == found.rmse_3d_m == found.max_error_m == found.p95_error_m == pytest.approx(5.0)
    assert (found.rmse_x_m, found.rmse_y_m, found.rmse_z_m) == pytest.approx((3.0, 4.0, 0.0))
    assert (found.rmse_v_mps, found.rmse_vx_mps, found.rmse_vz_mps) == pytest.approx((2.0, 0.0, 2.0))
    assert found.nees_position == pytest.approx(9.0 + 4.0)
    state[:, 0] -= 1e-6  # just inside three sigmas in x
    assert score(trajectory_for(truth, state=state, sigma=sigma), truth).in_3sigma == 1.0
    state[::2, 0] += 1.0
    assert score(trajectory_for(truth, state=state, sigma=sigma), truth).in_3sigma == pytest.approx(100 / 201)


def test_mean_error_and_rmse_differ() -> None:
    truth = flown()
    state = np.zeros((len(truth), 9))
    state[:, :3] = truth.position_m
    state[0, 0] += 201.0
    found = score(trajectory_for(truth, state=state), truth)
    assert found.rmse_seed_m == pytest.approx(1.0)
    assert found.rmse_3d_m == pytest.approx(201.0 / 201**0.5)
    assert found.max_error_m == pytest.approx(201.0)


def test_consistent_sigmas_give_nees_three_and_992_in_1000() -> None:
    truth = simulate("calibration", seed=1, duration_s=600.0, dt_s=0.02, outliers="none").truth
    t = trajectory_for(truth, error_m=4.0)
    found = score(replace(t, sigma=np.full((len(t), 9), 4.0)), truth)
    assert found.nees_position == pytest.approx(3.0, rel=0.03)
    assert found.in_3sigma == pytest.approx(0.9973**3, abs=0.002)


def test_sigmas_that_are_no_sigmas_are_left_out() -> None:
    truth = flown()
    t = trajectory_for(truth)
    sigma = np.full((len(t), 9), 1e9)
    sigma[::3], sigma[1::3] = np.nan, 0.0
    found = score(replace(t, sigma=sigma), truth)
    assert found.in_3sigma == 1.0
    assert found.nees_position == pytest.approx(0.0, abs=1e-9)
    nothing = score(replace(t, sigma=np.full((len(t), 9), np.nan)), truth)
    assert math.isnan(nothing.in_3sigma or 0)
    assert math.isnan(nothing.nees_position or 0)


def test_gradient_goes_the_short_way_round_the_cut() -> None:
    truth = flown()
    measurement = np.array([[10.0, 3.1, 0.1], [12.0, -3.1, 0.3], [np.nan, 3.1, 0.2], [9.0, 3.0, np.nan]])
    state = np.zeros((4, 9))
    t = trajectory_for(
        replace(truth, time_s=truth.time_s[:4], position_m=truth.position_m[:4], velocity_mps=None),
        measurement=measurement, state=state,
    )  # fmt: skip
    gradient = score(t).average_gradient
    assert gradient.range_m == pytest.approx(2.0)
    short = 2 * math.pi - 6.2
    assert gradient.azimuth_rad == pytest.approx((short + short + 0.1) / 3)
    assert gradient.elevation_rad == pytest.approx(0.15)


def test_without_truth_only_the_gradient() -> None:
    found = score(trajectory_for(flown()))
    assert found.rmse_3d_m is None
    assert found.truth is None
    assert set(found.as_dict()) == {"trajectory", "method", "samples", "average_gradient"}


def test_truth_without_velocity_or_flags() -> None:
    truth = replace(flown(), velocity_mps=None, acceleration_mps2=None, outlier=None)
    found = score(trajectory_for(truth), truth)
    assert found.rmse_3d_m is not None
    assert found.rmse_v_mps is None
    assert found.outliers is None
    assert not {"rmse_v_mps", "rmse_vx_mps", "outliers"} & set(found.as_dict())


@pytest.mark.parametrize("n", [0, 1, 2])
def test_tiny_trajectories(n: int) -> None:
    truth = flown()
    assert truth.velocity_mps is not None
    few = Truth("few", truth.time_s[:n], truth.position_m[:n], truth.velocity_mps[:n])
    t = trajectory_for(few)
    for against in (truth, few):
        found = score(t, against)
        assert found.samples == found.matched == n
        json.loads(render([found], "json"))
        render([found], "table")
    if n == 0:
        assert math.isnan(found.rmse_3d_m or 0)
        assert math.isnan(found.average_gradient.range_m)
