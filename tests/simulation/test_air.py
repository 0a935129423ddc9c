"""Flights by the forces of the air: the atmosphere against its tables, and what aircraft, bombs, shells, rockets and
released stores do."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from ftproc.records import FloatArray
from ftproc.simulation.flights.aerodynamic import AIR_STEP_S, CRAFTS, aerodynamic
from ftproc.simulation.flights.air import Air, by_mach, density, sound_mps
from ftproc.simulation.flights.kinds import FLIGHTS
from ftproc.simulation.flights.kinematics import DOWN_MPS2, GRAVITY_MPS2, constant_acceleration
from ftproc.simulation.flights.kinematics import flown as flown_by
from ftproc.simulation.flights.unsteered import UNSTEERED

AIRCRAFT = [f"aerodynamic-{name}" for name in CRAFTS]
LASTS_S = {**dict.fromkeys(AIRCRAFT, 90.0), **dict.fromkeys(UNSTEERED, 30.0)}
STEP_S = 0.005
SEEDS = range(4)


@cache
def flown(name: str, seed: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    time_s = np.arange(0.0, LASTS_S[name], STEP_S)
    return FLIGHTS[name](np.random.default_rng(seed), LASTS_S[name]).at(time_s)


def lift_and_drive(name: str, seed: int) -> tuple[FloatArray, FloatArray]:
    """(n,) m/s2 of the specific force across the path and along it."""
    _, v, a = flown(name, seed)
    force = a - DOWN_MPS2
    along = (force * v).sum(1) / np.maximum(np.linalg.norm(v, axis=1), 1.0)
    return np.sqrt(np.maximum((force**2).sum(1) - along**2, 0.0)), along


@pytest.mark.parametrize("name", list(LASTS_S))
def test_truth_is_the_integral_of_its_accelerations(name: str) -> None:
    position, velocity, acceleration = flown(name, 0)
    mean = 0.5 * (acceleration[1:] + acceleration[:-1])
    np.testing.assert_allclose(np.diff(velocity, axis=0), STEP_S * mean, atol=1e-2)
    np.testing.assert_allclose(np.diff(position, axis=0), STEP_S * 0.5 * (velocity[1:] + velocity[:-1]), atol=0.02)
    assert (position[:, 2] > 0).all()


def test_the_standard_atmosphere() -> None:
    """ISO 2533, tables 1 and 2."""
    for height_m, kgpm3, mps in ((0.0, 1.225, 340.29), (5000.0, 0.73643, 320.55), (11000.0, 0.36480, 295.07)):
        assert density(height_m) == pytest.approx(kgpm3, rel=3e-3)
        assert sound_mps(height_m) == pytest.approx(mps, abs=0.1)
    assert density(20000.0) == pytest.approx(0.08891, rel=1e-2)


def test_drag_rises_at_the_speed_of_sound() -> None:
    found = np.array([by_mach(mach, 1.5) for mach in (0.3, 0.8, 0.98, 1.1, 2.0, 4.0)])
    assert found[:2] == pytest.approx(1.0, abs=0.02)
    assert found[2] == pytest.approx(1.75, abs=0.01)
    assert found[3] == found.max() > 2.2
    assert (np.diff(found[3:]) < 0).all()


def test_gusts_have_their_size_and_length() -> None:
    air = Air(np.random.default_rng(1), 8.0, 2.0, length_m=100.0)
    found = np.array([air.further(5.0).copy() for _ in range(20000)])
    assert found.std() == pytest.approx(2.0, rel=0.1)
    later = (found[:-20] * found[20:]).mean() / (found**2).mean()  # 100 m on
    assert later == pytest.approx(np.exp(-1), abs=0.1)
    assert np.linalg.norm(air.wind(1000.0)) == pytest.approx(8.0)


@pytest.mark.parametrize("name", AIRCRAFT)
def test_aircraft_are_carried_by_their_wings(name: str) -> None:
    most = {"aerodynamic-fighter": 8.0, "aerodynamic-light": 4.0, "aerodynamic-airliner": 1.8}
    for seed in SEEDS:
        lift, along = lift_and_drive(name, seed)
        assert 0.8 < np.median(lift) / GRAVITY_MPS2 < 4.0
        assert lift.max() < most[name] * GRAVITY_MPS2
        assert abs(along).max() < 2 * GRAVITY_MPS2


def test_long_flights_have_longer_steps_and_the_same_lags() -> None:
    """An hour has steps of 0.18 s: the pilot still keeps to the path, and the wing carries the aircraft."""
    craft, lasts_s = CRAFTS["light"], 3600.0
    path = constant_acceleration(lasts_s, np.array([0.0, 0.0, 1500.0]), np.array([60.0, 0.0, 0.0]), np.zeros(3))
    force = aerodynamic(craft, path, True, np.random.default_rng(2))
    flight = flown_by(force, lasts_s, np.array([0.0, 0.0, 1500.0]), np.array([60.0, 0.0, 0.0]), AIR_STEP_S)
    time_s = np.arange(0.0, lasts_s, 1.0)
    position, _, acceleration = flight.at(time_s)
    assert flight.step_s > 5 * AIR_STEP_S
    assert np.linalg.norm(position - path.at(time_s)[0], axis=1).max() < 150.0
    assert np.linalg.norm(acceleration - DOWN_MPS2, axis=1).min() / GRAVITY_MPS2 > 0.3
    assert np.linalg.norm(acceleration - DOWN_MPS2, axis=1).max() / GRAVITY_MPS2 < 2.5


def test_bombs_and_shells_have_drag_alone() -> None:
    for seed in SEEDS:
        for name in ("bomb", "shell"):
            lift, along = lift_and_drive(name, seed)
            assert lift.max() < 0.2 * GRAVITY_MPS2 * max(1.0, abs(along).max() / GRAVITY_MPS2)
            assert np.mean(along < 0) > 0.9
        side = flown("shell", seed)[1][:, :2]
        turned = np.unwrap(np.arctan2(side[:, 1], side[:, 0]))
        assert 1e-3 < abs(turned[-1] - turned[0]) < 0.5  # it drifts, by its spin and the wind


def test_rockets_burn_one_or_two_stages_and_coast() -> None:
    burns = set()
    for seed in range(8):
        _, along = lift_and_drive("sounding-rocket", seed)
        driven = along > 2 * GRAVITY_MPS2
        burns.add(int((np.diff(driven.astype(int)) == -1).sum()))
        assert np.mean(driven) < 0.35
        assert not driven[-1]
        assert flown("sounding-rocket", seed)[0][-1, 2] > 100
    assert burns == {1, 2}


def test_what_is_released_falls() -> None:
    braked = 0
    for seed in range(8):
        lift, along = lift_and_drive("release", seed)
        n = len(lift)
        assert lift[: n // 5].min() > 0.5 * GRAVITY_MPS2
        assert np.median(lift[n // 2 :]) < 0.5 * GRAVITY_MPS2
        braked += int(along.min() < -2 * GRAVITY_MPS2)
    assert 0 < braked < 8


def test_they_are_followed_step_by_step() -> None:
    """The same seed gives the same flight, and the step is that of the air."""
    one, other = (FLIGHTS["aerodynamic-light"](np.random.default_rng(3), 20.0) for _ in range(2))
    np.testing.assert_array_equal(one.acceleration, other.acceleration)
    assert one.step_s == AIR_STEP_S
