"""The motion that a log's own readings choose."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from ftproc import pipeline
from ftproc.core import odds
from ftproc.core.filtering.initialization import find_starts
from ftproc.core.filtering.records import Model, Observations, Uneven
from ftproc.core.filtering.smoother import smooth_log
from ftproc.core.identification.motions import motion_models
from ftproc.core.identification.motions.motion_models import MODELS, WHITE, Candidates, choose, with_steps
from ftproc.core.identification.profile import fit_profile, with_allowance
from ftproc.core.model.motion import isotropic
from ftproc.methods import preparing
from ftproc.settings import AUTO, MOTIONS, FilterSettings
from ftproc.simulation import simulate
from tests.core.identification.test_likelihood import level
from tests.core.tracks import matched
from tests.trust import hard

pytestmark = pytest.mark.compiled

SMOOTH = FilterSettings(smooth=True)
MOTIONS_TRIED = (WHITE, "turning-force")


def errors(flight, **settings):
    """RMSE of position m and velocity m/s, and the summary."""
    found = pipeline.filter_log(flight.log, replace(SMOOTH, **settings))
    truth = np.concatenate([flight.truth.position_m, flight.truth.velocity_mps], 1)
    there = np.isin(flight.truth.time_s, found.time_s)
    wrong = (found.state[:, :6] - truth[there]) ** 2
    return np.sqrt([wrong[:, :3].sum(1).mean(), wrong[:, 3:].sum(1).mean()]), found.metadata["summary"]


def test_a_motion_that_a_filter_without_a_course_cannot_follow_is_not_chosen():
    """The smoother follows a ship in a seaway, about its course; about its own estimate the filter diverges."""
    ship = hard.make("sine", 1).simulated
    found = pipeline.filter_log(ship.log, FilterSettings())
    assert found.metadata["summary"]["motion"] == "white jerk"
    assert (np.abs(found.state[:, :3] - ship.truth.position_m) < 5 * found.sigma[:, :3]).all()


def test_an_aircraft_that_manoeuvres_has_a_force_that_turns():
    ratios = []
    for seed in range(3):
        flight = simulate("manoeuvre-clean", seed=seed)
        white, said = errors(flight, motion=WHITE)
        assert said["motion"] == "white jerk"
        assert said["motion_gain"] == 0.0
        found, said = errors(flight)
        assert said["motion"] == "turning force"
        assert said["motion_gain"] > 30
        ratios.append(found / white)
    position, velocity = np.median(ratios, 0)
    assert position < 0.94
    assert velocity < 0.88


def car(seed, acceleration_mps2=0.0):
    """A vehicle that turns this way and that while it keeps its speed or changes it steadily; 10 Hz for 40 s, in cells
    (400, 3) of a radar on the ground."""
    rng, time = np.random.default_rng(seed), 0.1 * np.arange(400.0)
    speed, heading = 6 + acceleration_mps2 * time, 1.5 * np.sin(2 * np.pi * time / 23.0 + rng.uniform(0, 6))
    path = np.cumsum(0.1 * speed[:, None] * np.column_stack([np.cos(heading), np.sin(heading)]), 0)
    x, y, z = *path.T + rng.uniform(15, 30, (2, 1)), np.full(400, 1.0)
    polar = np.column_stack([np.sqrt(x**2 + y**2 + z**2), np.arctan2(y, x), np.arctan2(z, np.hypot(x, y))])
    return time, polar + rng.normal(size=(400, 3)) * NOISE, np.column_stack([x, y, z])


NOISE = np.array([0.1, 5e-3, 5e-3])


@pytest.mark.parametrize("seed", range(3))
def test_a_car_keeps_its_speed_better_than_its_acceleration(monkeypatch, seed):
    (time, polar, truth), errors = car(seed), []
    log, white = Observations(time, polar, np.ones((400, 3))), Model(NOISE**2, isotropic(1.0))
    starts = find_starts(log, NOISE**2, 1.0)
    white = with_allowance(log, fit_profile(log, starts, white, 3))
    for rates in (motion_models.FADING, ()):
        monkeypatch.setattr(motion_models, "FADING", rates)
        found = choose(log, starts, white, Candidates(MOTIONS_TRIED))
        assert found.name == "turning-force"
        assert (found.model.motion.fades > 0) == (len(rates) > 0)
        velocity = smooth_log(found.log, found.model, found.starts).state[:, 3:6]
        errors.append(np.sqrt(((velocity - np.gradient(truth, time, axis=0))[10:-10] ** 2).mean()))
    assert errors[0] < 0.97 * errors[1]


def test_a_car_whose_speed_grows_steadily_does_not():
    time, polar, _ = car(1, acceleration_mps2=0.5)
    log, white = Observations(time, polar, np.ones((400, 3))), Model(NOISE**2, isotropic(1.0))
    starts = find_starts(log, NOISE**2, 1.0)
    white = with_allowance(log, fit_profile(log, starts, white, 3))
    assert choose(log, starts, white, Candidates(MOTIONS_TRIED)).model.motion.fades == 0


def fitted(a):
    return with_allowance(a.log, fit_profile(a.log, a.starts, level(a), 3))


@pytest.mark.parametrize("seed", range(3))
def test_a_flight_of_white_jerk_stays_one(seed):
    a = matched(seed, 400, dt=0.2, q=3.0)
    model, log = fitted(a), a.log
    found = choose(log, a.starts, model, Candidates(tuple(MODELS)))
    assert found.name == WHITE
    assert found.gain < odds.SURE
    assert found.model is model
    assert found.log is log
    assert found.row is None


def test_a_motion_that_is_about_as_likely_is_a_rival(monkeypatch):
    """The one that is not chosen, whichever that is."""
    log = simulate("manoeuvre-clean", seed=1).log
    a = Observations(log.time_s[:600], log.measurement[:600], np.ones((600, 3)))
    noise = np.array([5.0, 2e-4, 2e-4]) ** 2
    white = Model(noise, isotropic(100.0))
    starts = find_starts(a, noise, 100.0)
    white = with_allowance(a, fit_profile(a, starts, white, 3))
    names = (WHITE, "turning-force")
    assert choose(a, starts, white, Candidates(names)).rival is None  # far likelier
    monkeypatch.setattr(motion_models, "CLOSE", np.inf)
    found = choose(a, starts, white, Candidates(names))
    assert (found.name, found.rival.name) == ("turning-force", WHITE)
    monkeypatch.setattr(motion_models, "odds", SimpleNamespace(SURE=np.inf))
    found = choose(a, starts, white, Candidates(names))
    assert (found.name, found.rival.name) == (WHITE, "turning-force")
    assert choose(a, starts, white, Candidates(("turning-force",))).rival is None


def test_sigmas_allow_for_a_rival(monkeypatch):
    """They reach half the way to where it puts the target, where that is far."""
    flight = simulate("manoeuvre-clean", seed=1)
    (alone, turns), sigma = (pipeline.filter_log(flight.log, replace(SMOOTH, motion=m)) for m in MOTIONS_TRIED), []
    for margin in (odds.SURE, np.inf):
        monkeypatch.setattr(motion_models, "odds", SimpleNamespace(SURE=margin))
        monkeypatch.setattr(motion_models, "CLOSE", 2 * margin)
        sigma.append(pipeline.filter_log(flight.log, SMOOTH).sigma[:, :3])
    far = np.abs(alone.state[:, :3] - turns.state[:, :3])
    assert (sigma[1] >= np.hypot(alone.sigma[:, :3], 0.4 * far)).mean() > 0.95
    assert (sigma[1] > sigma[0]).mean() > 0.9


def test_a_single_name_is_taken():
    a = matched(1, 200, dt=0.2, q=3.0)
    found = choose(a.log, a.starts, fitted(a), Candidates(("turning-force",)))
    assert found.name == "turning-force"
    assert found.gain < 0
    assert found.model.motion.acts


def test_a_jerk_that_is_specified_is_white():
    assert preparing.motions(SMOOTH, None).names == tuple(MODELS)
    assert preparing.motions(replace(SMOOTH, jerk_psd_m2ps5=1.0), None).names == (WHITE,)
    assert preparing.motions(replace(SMOOTH, jerk_psd_m2ps5=1.0, motion="turning-force"), None).names == (
        "turning-force",
    )
    assert (AUTO, *MODELS) == MOTIONS


def test_gaps_are_crossed_in_steps():
    a = matched(2, 100, dt=0.2, q=1.0)
    kept = np.r_[0:40, 70:100]
    log = a.log.part(kept)._replace(uneven=Uneven.none(len(kept)))
    course = a.truth[kept].copy()
    course[:, 3:6], course[:, 6:] = [100.0, 0.0, 0.0], [0.0, 20.0, 0.0]  # 0.2 rad/s
    dense, starts, row = with_steps(log, a.starts, course)
    assert row is not None
    np.testing.assert_array_equal(dense.time_s[row], log.time_s)
    np.testing.assert_array_equal(dense.measurement[row], log.measurement)
    between = np.setdiff1d(np.arange(len(dense.time_s)), row)
    assert (dense.weight[between] == 0).all()
    assert np.isnan(dense.measurement[between]).all()
    assert np.diff(dense.time_s).max() <= motion_models.FARTHEST_TURN / 0.2 * 1.05
    assert starts[0].sample == 0
    # with white jerk they change nothing
    found = motion_models.Chosen(WHITE, a.model, 0.0, dense, starts, a.model, row)
    run, plain = found.of_rows(smooth_log(dense, a.model, starts)), smooth_log(log, a.model, a.starts)
    np.testing.assert_allclose(run.state, plain.state, rtol=1e-7, atol=1e-6)
    np.testing.assert_allclose(run.sigma, plain.sigma, rtol=1e-6)
    assert with_steps(a.log, a.starts, a.truth * 0)[2] is None


@pytest.mark.parametrize(("scenario", "position", "velocity"), [("ballistic", 0.9, 0.8), ("release", 0.93, 0.85)])
def test_what_nobody_steers_is_told_by_its_drag(scenario, position, velocity):
    """Bombs, shells, rockets that burn first, and stores that an aircraft carries first: by one law of force."""
    ratios, names = [], []
    for seed in range(1, 7):
        flight = simulate(scenario, seed=seed)
        white, _ = errors(flight, motion=WHITE)
        found, said = errors(flight)
        names.append(said["motion"])
        ratios.append(found / white)
    assert names.count("ballistic") >= 5
    assert (np.median(ratios, 0) < [position, velocity]).all()
    assert np.max(ratios) < 1.02
