"""Runs that are off together: their score against the slope of the likelihood, the search against a plain one."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.editing import runs, two_pass
from ftproc.core.filtering.smoother import smooth_log
from ftproc.core.identification.stretches import runs_of
from tests.core.tracks import matched
from tests.simulated import codes, simulate

UNKNOWN = two_pass.Known(np.full(3, np.nan), None, 4.0)


@pytest.mark.parametrize("component", range(3))
@pytest.mark.parametrize(("begin", "end"), [(40, 41), (60, 75), (5, 90)])
def test_sum_of_smoothations_is_the_score_of_a_common_offset(component, begin, end):
    """d log-likelihood / d offset of the run's readings, by central differences."""
    a = matched(3, 120)
    run = smooth_log(a.log, a.model, a.starts)
    step = 1e-3 * np.sqrt(a.model.noise_variance[component])
    likelihood = []
    for sign in (1, -1):
        shifted = a.z.copy()
        shifted[begin:end, component] += sign * step
        likelihood.append(smooth_log(a.log._replace(measurement=shifted), a.model, a.starts).log_likelihood)
    slope = (likelihood[0] - likelihood[1]) / (2 * step)
    total = (run.residual / run.residual_variance)[begin:end, component].sum()
    assert -total == pytest.approx(slope, rel=2e-2, abs=2e-2 / np.sqrt(a.model.noise_variance[component]))


def plain_scan(total, scale):
    m, longest = len(total) - 1, len(scale) - 1
    scored = [
        max((abs(total[b + length] - total[b]) / scale[length], b + length) for length in range(2, longest + 1)
            if b + length <= m) for b in range(m - 1)
    ]  # fmt: skip
    found, taken = np.zeros(m, bool), []
    for begin in sorted(range(m - 1), key=lambda b: -scored[b][0]):
        score, end = scored[begin]
        if score < runs.SURE:
            break
        if all(end <= low or begin >= high for low, high in taken):
            found[begin:end] = True
            taken.append((begin - longest, end + longest))
    return found


@pytest.mark.parametrize("seed", range(4))
def test_search_is_the_plain_one(seed):
    rng = np.random.default_rng(seed)
    u = rng.standard_normal(400)
    for begin, end, size in ((50, 62, 2.5), (140, 145, -5.0), (300, 330, 1.5)):
        u[begin:end] += size
    residual = np.tile(u[:, None], (1, 3))
    found = runs.suspicious(0.1 * np.arange(400), residual, np.ones((400, 3)), np.ones((400, 3)), 10.0)
    total = np.r_[0.0, np.cumsum(u)]
    np.testing.assert_array_equal(found[:, 0], plain_scan(total, runs._scales(total, runs.LONGEST)))
    assert found[50:62, 0].mean() > 0.5


@pytest.mark.parametrize("n", [150, 9000])
def test_scales_are_the_medians_of_the_sums(n):
    """Of some lengths; what lies between them follows."""
    total = np.r_[0.0, np.cumsum(np.random.default_rng(n).standard_normal(n))]
    sums = [np.sort(np.abs(total[length:] - total[:-length])) for length in range(2, 49)]
    plain = np.array([1.4826 * s[len(s) // 2] for s in sums])
    scales = runs._scales(total, 48)
    assert np.isinf(scales[:2]).all()
    np.testing.assert_allclose(scales[[2, 3, 4, 5, 48]], plain[[0, 1, 2, 3, 46]], rtol=1e-12 if n < 1000 else 0.15)
    np.testing.assert_allclose(scales[2:], plain, rtol=0.15)


def test_noise_alone_is_no_run():
    rng = np.random.default_rng(1)
    found = runs.suspicious(
        0.1 * np.arange(3000), rng.standard_normal((3000, 3)), np.ones((3000, 3)), np.ones((3000, 3)), 10.0
    )
    assert found.mean() < 0.005


def test_long_runs_are_no_patches_at_one_reading_a_second():
    """Six seconds: what lasts longer at a low rate may be a turn."""
    u = np.random.default_rng(2).standard_normal((400, 3))
    u[100:130] += 3.0
    fast, slow = (
        runs.suspicious(dt * np.arange(400), u, np.ones((400, 3)), np.ones((400, 3)), 1.5) for dt in (0.1, 1.0)
    )
    assert fast[100:130].all()
    assert np.diff(runs_of(slow[:, 0])).max() <= 6


def test_too_few_readings_say_nothing():
    u = np.ones((runs.FEWEST - 1, 3))
    assert not runs.suspicious(np.arange(len(u)) * 0.1, u, np.ones_like(u), np.ones_like(u), 10.0).any()


def test_curve_is_not_confirmed_but_a_step_is():
    suspects = np.zeros((60, 3), bool)
    suspects[20:40] = True
    residual = np.zeros((60, 3))
    residual[20:40, 0] = 3.0
    residual[20:40, 1] = 3.0 * np.sin(np.linspace(0, np.pi, 20))
    residual[20:40, 2] = np.where(np.arange(20) < 10, 3.0, -3.0)
    kept = runs.confirmed(suspects, residual, np.ones((60, 3)))
    assert kept[20:40, 0].all()
    assert not kept[:, 1:].any()
    assert not kept[:20].any()


@pytest.mark.compiled
@pytest.mark.parametrize("seed", [0, 9, pytest.param(5, marks=pytest.mark.slow)])
def test_weak_patches_are_found(seed):
    """Patches of 3 to 8 sigmas, which hide between manoeuvres and noise."""
    flight = simulate("manoeuvre", seed=seed, outliers="patch=6:5-40:3-8")
    edited = two_pass.edit(flight.log.time_s, flight.log.measurement, UNKNOWN)
    bad = codes(flight) > 0
    assert (edited.weight[bad] == 0).mean() > 0.6
    assert (edited.weight[~bad] == 0).mean() < 0.002
    error = np.linalg.norm(edited.smoothed().state[:, :3] - flight.truth.position_m, axis=1)
    assert np.sqrt((error**2).mean()) < 1.7
