"""The allowance for unseen motion, against a plain sum over octaves, and what it promises."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.filtering.records import Model, Observations, Start
from ftproc.core.filtering.smoother import smooth_log
from ftproc.core.identification.motions.unseen_motion import AT_REST, FASTEST, GUST_MPS, HIDDEN, PER_SPEED, widened
from ftproc.core.model.frames import from_cartesian, line_of_sight_axes
from ftproc.core.model.motion import isotropic


def states(n, seed=1):
    rng = np.random.default_rng(seed)
    state = np.hstack([rng.normal(0, 3e3, (n, 3)), rng.normal(0, 100, (n, 3)), rng.normal(0, 3, (n, 3))])
    position = 10 ** rng.uniform(-3, 2, (n, 3))
    w = 10 ** rng.uniform(-3, 1.5, (n, 3))
    return state, np.hstack([position, 0.7 * position * w, position * w**2])


def plain(state, sigma, falls):
    """(n, 9) variances, octave by octave."""
    added = np.zeros_like(sigma)
    for k, i in np.ndindex(len(state), 3):
        speed = np.linalg.norm(state[k, 3:6])
        push = AT_REST**2 + (PER_SPEED * speed) ** 2
        if falls:  # its drag is the force by speed squared: a gust along the path adds twice its share of the speed
            drag = np.linalg.norm(state[k, 6:] + [0, 0, 9.80665])
            push = (2 * drag * GUST_MPS) ** 2 / (speed**2 + 3.0**2)
        first = np.sqrt(sigma[k, 6 + i] / sigma[k, i])
        for octave in range(40):
            w = 2.0**octave * first
            share = np.clip(2 - w / FASTEST, 0, 1)
            size = min(push * share / w**4, HIDDEN * 2.0**octave * sigma[k, i] ** 2)
            left = size / (1 + 2.0 ** (-6 * octave)) ** 2 * (share > 0)
            added[k, [i, 3 + i, 6 + i]] += left * np.array([1, w**2, w**4])
    return sigma**2 + added


@pytest.mark.parametrize("falls", [False, True])
def test_sum_over_octaves(falls):
    state, sigma = states(200)
    found, _ = widened(state, sigma, np.zeros((200, 6)), falls)
    np.testing.assert_allclose(found**2, plain(state, sigma, falls), rtol=1e-9)


def test_along_the_line_of_sight():
    """The same variances, turned."""
    state, sigma = states(50, seed=2)
    found, along = widened(state, sigma, np.ones((50, 6)))
    axes = line_of_sight_axes(state[:, :3])
    for at in (0, 3):
        added = found[:, at : at + 3] ** 2 - sigma[:, at : at + 3] ** 2
        np.testing.assert_allclose(along[:, at : at + 3] ** 2, 1 + np.einsum("nia,na->ni", axes**2, added), rtol=1e-9)


def test_nothing_is_made_of_nothing():
    """Unknown sigmas stay unknown, zeros stay zero, absurd ones end."""
    state = np.zeros((4, 9))
    sigma = np.array([np.full(9, np.nan), np.zeros(9), [1e-300] * 3 + [1.0] * 6, [1e100] * 3 + [1e-300] * 6])
    found, _ = widened(state, sigma, np.full((4, 6), np.nan))
    assert np.isnan(found[0]).all()
    assert (found[1] == 0).all()
    assert np.isfinite(found[2:]).all()


def test_what_is_followed_is_not_added():
    """A filter that follows every motion of an airframe has sigmas that cover it already."""
    state, sigma = states(1)
    sigma[:, 6:] = sigma[:, :3] * (4 * FASTEST) ** 2
    found, _ = widened(state, sigma, np.zeros((1, 6)))
    np.testing.assert_array_equal(found, sigma)


def test_the_noise_bounds_it():
    """A total station on a target that stands still: what it cannot see is below its noise, whatever flights do."""
    state, sigma = states(1)
    sigma[:] = np.repeat([1e-6, 1e-8, 1e-10], 3)
    found, _ = widened(state, sigma, np.zeros((1, 6)))
    noise = np.sqrt(3) * 1e-6 * np.sqrt(FASTEST / 1e-2)  # of all octaves up to the fastest
    assert (found[:, :3] < 2 * noise).all()
    assert (found[:, 3:6] < 2 * FASTEST * 2 * noise).all()


@pytest.mark.compiled
@pytest.mark.parametrize("share", [0.5, 1.0, 2.0, 4.0])
def test_what_a_smoother_leaves_of_a_swing(share):
    """1 / (1 + (w0 / w)^6), with w0 from its own sigmas: measured, on a swing without noise."""
    time, base = 0.1 * np.arange(4000), np.array([1e4, 0.0, 0.0])
    model, start = Model(np.array([1.0, 1e-8, 1e-8]), isotropic(1.0)), Start(0, np.r_[base, np.zeros(6)], np.eye(9))

    def smoothed(swing):
        z = from_cartesian(base + np.stack([swing, 0 * swing, 0 * swing], 1))
        return smooth_log(Observations(time, z, np.ones((4000, 3))), model, [start])

    still = smoothed(0 * time)
    w = share * np.sqrt(still.sigma[2000, 6] / still.sigma[2000, 0])
    swing = 0.1 * np.sin(w * time)
    left = (smoothed(swing).state[:, 0] - base[0] - swing)[1000:3000] / 0.1
    np.testing.assert_allclose(np.sqrt(2) * left.std(), 1 / (1 + share**-6), rtol=0.1, atol=0.01)
