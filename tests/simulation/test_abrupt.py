"""Flights whose forces change at once: the truth is the integral of its accelerations, and each does what it is
named for."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from ftproc.records import FloatArray
from ftproc.simulation.flights.abrupt import ABRUPT
from ftproc.simulation.flights.kinematics import STEP_S

LASTS_S = 50.0
TIME_S = np.arange(0.0, LASTS_S, STEP_S)


@cache
def flown(name: str, seed: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    return ABRUPT[name](np.random.default_rng(seed), LASTS_S).at(TIME_S)


def speed(velocity: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(velocity, axis=1))


@pytest.mark.parametrize("name", list(ABRUPT))
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_truth_is_the_integral_of_its_accelerations(name: str, seed: int) -> None:
    position, velocity, acceleration = flown(name, seed)
    mean = 0.5 * (acceleration[1:] + acceleration[:-1])
    np.testing.assert_allclose(np.diff(velocity, axis=0), STEP_S * mean, atol=1e-9)
    np.testing.assert_allclose(np.diff(position, axis=0), STEP_S * 0.5 * (velocity[1:] + velocity[:-1]), atol=0.02)
    assert (position[:, 2] > 0).all()


@pytest.mark.parametrize("name", list(ABRUPT))
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_forces_change_within_a_second_in_the_middle(name: str, seed: int) -> None:
    _, _, acceleration = flown(name, seed)
    change = np.linalg.norm(acceleration[200:] - acceleration[:-200], axis=1)
    first = TIME_S[np.argmax(change > 0.5 * change.max())] + 200 * STEP_S
    assert change.max() > 5.0
    assert 0.25 * LASTS_S < first < 0.75 * LASTS_S


def test_each_does_what_it_is_named_for() -> None:
    for seed in range(3):
        assert 4.5 < speed(flown("parachute", seed)[1])[-1] < 9.5
        assert speed(flown("impact", seed)[1])[-1] < 1e-3 < 100 < speed(flown("impact", seed)[1]).max()
        assert speed(flown("touch-down", seed)[1])[0] > 49
        assert abs(flown("touch-down", seed)[1][-1, 2]) < 1e-3
        assert speed(flown("catapult", seed)[1])[0] == 0 < 40 < speed(flown("catapult", seed)[1])[-1]
        ignition = speed(flown("ignition", seed)[1])
        assert ignition.max() > ignition[0] + 150
        _, velocity, acceleration = flown("separation", seed)
        pushed = (acceleration * velocity).sum(1) > 10 * speed(velocity)
        assert (np.diff(pushed.astype(int)) == 1).sum() == 1  # it coasts between the stages
