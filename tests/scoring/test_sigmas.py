"""Whether published sigmas hold: shares, the worst row, NEES with bounds for correlated errors, and the words."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

import ftproc
from ftproc.core.model.frames import from_cartesian, wrap
from ftproc.records import FloatArray
from ftproc.scoring import render, score
from ftproc.scoring.figures import Score
from ftproc.scoring.sigmas import consistency, degrees_of_freedom, least_share, nees_bounds
from ftproc.settings import FilterSettings
from tests.simulated import flown, simulate, trajectory_for


def correlated(n: int, memory: float, axes: int = 3, seed: int = 0) -> FloatArray:
    """(n, axes) Gauss-Markov errors of variance 1 with a correlation of 1/e over so many rows; 0 for white ones."""
    rng, keep = np.random.default_rng(seed), np.exp(-1 / memory) if memory else 0.0
    found = rng.standard_normal((n, axes))
    for k in range(1, n):
        found[k] = keep * found[k - 1] + (1 - keep**2) ** 0.5 * found[k]
    return found


def judged(ratio: FloatArray, axes: str = "xyz") -> str:
    found = consistency(np.arange(float(len(ratio))), ratio, axes)
    assert found is not None
    return found.sigma_verdict


@pytest.mark.parametrize(
    ("scale", "verdict"),
    [((1, 1, 1), "consistent"), ((0.3, 0.3, 0.3), "cautious"), ((1, 1, 3), "overconfident in z"),
     ((2, 2, 2), "overconfident in x, y, z")],
)  # fmt: skip
def test_verdict_in_words(scale: tuple[float, ...], verdict: str) -> None:
    assert judged(np.random.default_rng(5).standard_normal((4000, 3)) * scale) == verdict


def test_no_sigma_no_verdict() -> None:
    assert consistency(np.empty(0), np.empty((0, 3)), "xyz") is None
    assert consistency(np.arange(4.0), np.full((4, 3), np.nan), "xyz") is None


def test_one_row_far_off_is_overconfident_and_has_its_time() -> None:
    ratio = np.random.default_rng(0).standard_normal((5000, 3))
    ratio[7, 1] = -22_670.0
    found = consistency(0.5 * np.arange(5000), ratio, ("vx", "vy", "vz"))
    assert found is not None
    assert (found.largest_sigma, found.largest_sigma_time_s) == (22_670.0, 3.5)
    assert found.share_in_3_sigma > 0.98
    assert found.sigma_verdict == "overconfident in vy"
    ratio[7, 1] = 12.5  # too few to move the mean
    assert judged(ratio) == "overconfident in y"


@pytest.mark.parametrize("memory", [0.0, 5.0, 50.0])
def test_degrees_of_freedom_are_those_of_the_spread_of_many_flights(memory: float) -> None:
    """A mean of m squares with nu degrees of freedom has variance 2 m^2 / nu."""
    flights = [correlated(1500, memory, seed=seed) for seed in range(200)]
    expected = 2 * 9 / np.var([(ratio**2).sum(1).mean() for ratio in flights])
    assert np.median([degrees_of_freedom(ratio) for ratio in flights[:50]]) == pytest.approx(expected, rel=0.4)


def test_degrees_of_freedom_of_a_constant_error_are_the_axes() -> None:
    ones = np.ones((1000, 3))
    ones[:, 1], ones[::2, 2] = np.random.default_rng(1).choice([-1, 1], 1000), -1
    assert degrees_of_freedom(np.ones((1000, 1))) == pytest.approx(1.0, rel=1e-6)
    assert degrees_of_freedom(ones) > 3


@pytest.mark.parametrize(("n", "memory"), [(60, 0), (1000, 0), (1000, 30), (200, 60), (4000, 200)])
def test_consistent_flights_are_called_so(n: int, memory: float) -> None:
    """However correlated their errors are; but not those with sigmas that are half as large."""
    words = [judged(correlated(n, memory, seed=seed)) for seed in range(60)]
    assert words.count("consistent") >= 54
    if n >= 1000 and memory <= 30:
        assert all(judged(2 * correlated(n, memory, seed=seed)).startswith("overconfident") for seed in range(60))


def test_bounds() -> None:
    assert nees_bounds(1e6, 3) == (1.0, 5.0)
    low, high = nees_bounds(3, 3)
    assert low == pytest.approx(0.0717, abs=0.05)  # chi-square with 3 degrees of freedom, 0.5 and 99.5 %
    assert high == pytest.approx(12.84, rel=0.01)
    assert least_share(1e6, 3) == 0.97
    assert least_share(3, 3) == 0.9


@pytest.fixture(scope="module")
def scored() -> Score:
    flight = simulate("manoeuvre-clean", seed=5, duration_s=60.0)
    return score(ftproc.filter_log(flight.log, FilterSettings(smooth=True)), flight.truth)


def test_each_quantity_is_counted_with_its_own_sigmas() -> None:
    flight = simulate("manoeuvre-clean", seed=5, duration_s=30.0)
    t, truth = ftproc.filter_log(flight.log), flight.truth
    found = score(t, truth)
    state = np.hstack([truth.position_m, truth.velocity_mps, truth.acceleration_mps2])  # type: ignore[list-item]
    off = t.measurement - from_cartesian(truth.position_m)
    off[:, 1] = wrap(off[:, 1])
    ratios = [(t.state - state)[:, k : k + 3] / t.sigma[:, k : k + 3] for k in (0, 3, 6)]
    parts = (found.position, found.velocity, found.acceleration, found.cleaned)
    for part, ratio in zip(parts, [*ratios, off / t.measurement_sigma], strict=True):
        assert part is not None
        assert part.share_in_3_sigma == pytest.approx((np.abs(ratio) <= 3).all(1).mean())
        assert part.nees == pytest.approx((ratio**2).sum(1).mean())
        assert part.largest_sigma == pytest.approx(np.abs(ratio).max())
        assert part.largest_sigma_time_s == t.time_s[np.abs(ratio).max(1).argmax()]
    assert found.rmse_azimuth_rad == pytest.approx(np.sqrt((off[:, 1] ** 2).mean()))
    assert found.rmse_a_mps2 == pytest.approx(np.sqrt(((t.state - state)[:, 6:] ** 2).sum(1).mean()))
    assert (found.in_3sigma, found.nees_position) == (found.position.share_in_3_sigma, found.position.nees)  # type: ignore[union-attr]


@pytest.mark.parametrize("columns", [slice(3, 6), slice(6, 9)], ids=["velocity", "acceleration"])
def test_the_sigmas_are_consistent_only_if_all_are(columns: slice) -> None:
    flight = simulate("manoeuvre-clean", seed=5, duration_s=60.0)
    t = ftproc.filter_log(flight.log)
    assert score(t, flight.truth).sigma_verdict == "consistent"
    sigma = t.sigma.copy()
    sigma[5, columns] *= 1e-5
    word = score(replace(t, sigma=sigma), flight.truth).sigma_verdict
    assert word is not None
    assert word.startswith(f"overconfident in {'va'[columns == slice(6, 9)]}")
    cleaned = t.measurement_sigma.copy()
    cleaned[:, 2] /= 10
    assert score(replace(t, measurement_sigma=cleaned), flight.truth).sigma_verdict == "overconfident in elevation"


def test_what_is_printed(scored: Score) -> None:
    lines = [line.split("  ") for line in render([scored]).splitlines()]
    cells = [(line[0].strip() or line[1].strip(), line[-1].strip()) for line in lines]
    at = [label for label, _ in cells].index("velocity inside 3 sigma")
    assert scored.velocity is not None
    assert cells[at][1] == f"{scored.velocity.share_in_3_sigma:.4g}"
    when = f"{scored.velocity.largest_sigma:.3g} at {scored.velocity.largest_sigma_time_s:.7g} s"
    assert cells[at + 1] == ("largest error / sigma", when)
    assert cells[at + 2] == ("NEES (bounds)", f"{scored.velocity.nees:.3g} (1 to 5)")
    known = json.loads(render([scored], "json"))
    assert known["velocity"]["share_in_3_sigma"] == scored.velocity.share_in_3_sigma
    assert "velocity.share_in_3_sigma" in render([scored], "csv").splitlines()[0].split(",")


@pytest.mark.parametrize("absent", [[0], [1, 2]], ids=["angles only", "range only"])
def test_a_log_of_some_components_is_compared_with_the_truth_s_own(absent: list[int]) -> None:
    flight = simulate("calibration", seed=3, duration_s=200.0)  # circles: the azimuth passes the cut
    z = flight.log.measurement.copy()
    z[:, absent] = np.nan
    found = score(ftproc.filter_log(replace(flight.log, measurement=z)), flight.truth)
    assert found.cleaned is not None
    assert found.position is None
    assert found.cleaned.share_in_3_sigma > 0.97
    assert found.sigma_verdict == "consistent"
    assert found.without_estimate == len(z)
    rmse = (found.rmse_range_m, found.rmse_azimuth_rad, found.rmse_elevation_rad)
    for c in range(3):
        if c in absent:
            assert rmse[c] is None
        else:
            assert 0 < rmse[c] < flight.sigma[c]  # type: ignore[operator]
    assert "cleaned inside 3 sigma" in render([found])


def test_a_fused_trajectory_has_no_cleaned_readings() -> None:
    truth = flown()
    nothing = np.full((len(truth), 3), np.nan)
    found = score(trajectory_for(truth, measurement=nothing, measurement_sigma=nothing), truth)
    assert found.cleaned is None
    assert found.rmse_range_m is None
    assert "cleaned" not in render([found])
