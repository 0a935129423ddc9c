"""Satellites over a turning earth, flown here by their equations in an integrator of scipy, with J2."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ftproc import pipeline
from ftproc.core.identification.motions import orbits
from ftproc.core.identification.motions.orbits import EARTH_RADPS, _direction, earth_below, earth_from
from ftproc.core.model.earth import earth_centred, verticals
from ftproc.core.model.frames import from_cartesian
from ftproc.records import MeasurementLog
from ftproc.settings import FilterSettings

pytestmark = pytest.mark.compiled

EQUATOR_M, MU_M3PS2, J2 = 6378137.0, 3.986004418e14, 1.08263e-3
LOWEST_RAD = 0.14  # over the horizon
SMOOTH = FilterSettings(smooth=True)
#: height m, s of a pass, s between readings, 1-sigma m and rad, share of outliers in range (where readings are minutes
#: apart, white jerk hides them), times of white jerk's errors of position and velocity.
PASSES = [
    (500e3, 500, 0.5, 5.0, 1e-4, 0.02, 0.8, 0.3),
    (1200e3, 900, 5.0, 3.0, 5e-5, 0.02, 0.9, 0.5),
    (6000e3, 4000, 30.0, 4.0, 1e-4, 0.0, 0.6, 0.2),
    (20000e3, 9000, 120.0, 5.0, 3e-5, 0.0, 0.6, 0.1),
]


def below(site, north):
    """(3,) the earth's rotation and (3,) its centre, as they are seen from a site with north at an angle from x."""
    c, s = np.cos(north), np.sin(north)
    axes = np.array([[s, -c, 0], [c, s, 0], [0, 0, 1]]).T  # east, north, up
    return axes @ verticals(site) @ [0, 0, EARTH_RADPS], -axes @ verticals(site) @ earth_centred(site)


def passed(draw, height_m, lasts_s, dt_s, range_m, angle_rad, outliers, north=None):
    """A log with outliers in range, its truth (n, 6), and the site."""
    latitude, anywhere, along, off = draw.uniform((-1.0, 0.0, 0.0, -0.1), (1.2, 6.3, 6.3, 0.1))
    site = (np.degrees(latitude), 10.0, 300.0)
    turn, centre = below(site, anywhere if north is None else north)
    axis = turn / EARTH_RADPS
    ahead, aside = np.array([np.cos(along), np.sin(along), 0]), np.array([-np.sin(along), np.cos(along), 0])
    radius = np.linalg.norm(centre) + height_m
    begin = radius * (np.cos(off) * np.array([0, 0, 1]) + np.sin(off) * aside)
    speed = np.sqrt(MU_M3PS2 / radius * (1 + draw.uniform(0, 0.02)))

    def flow(_, state):
        x, v = state[:3], state[3:]
        r, up = np.linalg.norm(x), x @ axis
        flat = 1.5 * J2 * MU_M3PS2 * EQUATOR_M**2 / r**5 * ((1 - 5 * up**2 / r**2) * x + 2 * up * axis)
        pull = -MU_M3PS2 * x / r**3 - flat
        return np.concatenate([v, pull - 2 * np.cross(turn, v) - np.cross(turn, np.cross(turn, x))])

    t = np.arange(0, lasts_s, dt_s) - lasts_s / 2
    first = np.concatenate([begin, speed * ahead - np.cross(turn, begin)])
    sides = [solve_ivp(flow, (0, end), first, "DOP853", rtol=1e-11, dense_output=True).sol for end in (t[0], t[-1])]
    state = np.where(t < 0, sides[0](np.minimum(t, 0)), sides[1](np.maximum(t, 0))).T
    state[:, :3] += centre
    reading = from_cartesian(state[:, :3])
    state, t, reading = (each[reading[:, 2] > LOWEST_RAD] for each in (state, t, reading))
    reading += draw.standard_normal(reading.shape) * [range_m, angle_rad, angle_rad]
    reading[draw.random(len(t)) < outliers, 0] += 50 * range_m
    return MeasurementLog("a pass", t - t[0], reading, np.arange(len(t))), state, site


@pytest.mark.parametrize("seed", range(len(PASSES)))
def test_a_satellite_is_moved_by_gravity(seed):
    *what, nearer, slower = PASSES[seed]
    log, truth, _ = passed(np.random.default_rng(seed), *what)
    white, found = (pipeline.filter_log(log, replace(SMOOTH, motion=motion)) for motion in ("white-jerk", "auto"))
    summary = found.metadata["summary"]
    assert summary["motion"] == "orbital"
    assert summary["trust"]["verdict"] == "consistent"
    assert 1 / 3 < summary["components"]["range"]["noise_m"] / what[3] < 3
    off = found.state[:, :6] - truth
    assert (np.abs(off) < 3 * found.sigma[:, :6]).mean() > 0.98
    before, after = (((one.state[:, :6] - truth) ** 2).reshape(-1, 2, 3).sum(2).mean(0) for one in (white, found))
    assert (np.sqrt(after / before) < (nearer, slower)).all()


@pytest.mark.parametrize(("of", "seed", "farthest_m"), [(3, 53, 600), (2, 12, 3000)])
def test_the_course_about_which_gravity_is_followed_may_begin_far_off(of, seed, farthest_m):
    """Ranges in every third row, and without angles, of the later half of a pass: about the first course they are 338
    and 36 km off, and the second one 28 if the search begins with one level of the jerk."""
    log, truth, _ = passed(np.random.default_rng(seed), *PASSES[of][:5], 0.0, north=np.pi / 2)
    measurement, row = log.measurement.copy(), np.arange(len(log))
    ranged = (row % 3 == 0) & (row > len(log) / 2)
    measurement[~ranged, 0], measurement[ranged, 1:] = np.nan, np.nan
    found = pipeline.filter_log(replace(log, measurement=measurement), SMOOTH)
    assert found.metadata["summary"]["motion"] == "orbital"
    assert np.abs(found.state[:, :3] - truth[:, :3]).max() < farthest_m


def test_a_site_tells_how_the_earth_turns():
    """Ranges of the later half of a pass, at 1,200 km. North is y, or with an azimuth from there, x."""
    log, truth, site = passed(np.random.default_rng(1), *PASSES[1][:5], 0.0, north=np.pi / 2)
    measurement = log.measurement.copy()
    measurement[: len(log) // 2, 0] = np.nan
    log = replace(log, measurement=measurement)
    measurement = measurement.copy()
    measurement[:, 1] = np.pi / 2 - measurement[:, 1]
    settings = replace(SMOOTH, site=site)
    found = pipeline.filter_log(log, SMOOTH), pipeline.filter_log(log, settings)
    of_north = pipeline.filter_log(replace(log, measurement=measurement, frame="north-east-up"), settings)
    np.testing.assert_allclose(of_north.state[:, [1, 0, 2]], found[1].state[:, :3], atol=2.0)
    unknown, known = (np.abs(each.state[:, :3] - truth[:, :3]).max() for each in found)
    assert known < unknown / 2
    assert found[1].metadata["summary"]["motion"] == "orbital"


def test_what_flies_in_the_air_is_in_no_orbit():
    course = np.zeros((10, 9))
    assert not orbits.may_be(course)
    course[:, 0] = 500e3  # where the ground is 20 km lower
    assert not orbits.may_be(course)
    course[:, 2] = 200e3
    assert orbits.may_be(course)


@pytest.mark.parametrize("direction", [(0.7, 1.2), (-1.0, -2.0), (0.0, 3.0)])
def test_directions_of_the_earths_axis(direction):
    earth = earth_below(*direction, 250.0)
    np.testing.assert_allclose(_direction(earth), direction, atol=1e-12)
    turn, centre = below((np.degrees(direction[0]), 77.0, 250.0), direction[1])
    np.testing.assert_allclose(earth[0], turn, atol=1e-18)
    np.testing.assert_allclose(earth[1], centre, atol=1e-6)


@pytest.mark.parametrize("north", [0, 1])
def test_the_earth_below_a_site(north):
    """An axial vector changes its sign with the hand of the axes: with it, what turns eastward does."""
    earth = earth_from((50.0, 10.0, 100.0), north)
    off = np.array([1e3, 2e3, 3e3]) - earth[1]
    east = np.eye(3)[1 - north]
    assert np.cross(earth[0], off) @ east == pytest.approx(np.linalg.norm(np.cross(earth[0], off)), rel=1e-3)
    assert np.linalg.norm(earth[1]) == pytest.approx(np.linalg.norm(earth_centred((50.0, 10.0, 100.0))))
