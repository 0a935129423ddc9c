"""The first track of several stations: which of the points it goes through where readings meet in more than one."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.model import stations as geometry
from ftproc.fusion.estimation import first_track
from ftproc.fusion.estimation.events import Seen

TIME_S = np.arange(0.0, 60.0, 0.5)
PATH = np.c_[-3000.0 + 100.0 * TIME_S, np.full_like(TIME_S, 4000.0), np.full_like(TIME_S, 1500.0)]
SIGMA = np.array([3.0, 2e-4, 2e-4])


def seen(name, place, components, during=(0.0, 60.0), offset_m=0.0, away=None):
    """A station with noise. offset_m: of all that it sees while away (from, to) s."""
    here = (during[0] <= TIME_S) & (during[1] >= TIME_S)
    path = PATH[here].copy()
    if away:
        path[(TIME_S[here] >= away[0]) & (TIME_S[here] < away[1])] += offset_m
    place = np.array(place, float)
    z = geometry.measured(path, place, np.eye(3)) + SIGMA * np.random.default_rng(1).standard_normal((len(path), 3))
    z[:, [c for c in range(3) if c not in components]] = np.nan
    return Seen(name, TIME_S[here], z, place, np.eye(3), np.zeros(8), np.full(3, np.nan), np.zeros(z.shape, bool))


def error_m(stations):
    weight = [np.isfinite(each.measurement).astype(float) for each in stations]
    track = first_track.find(stations, weight, np.tile(SIGMA, (len(stations), 1)))
    assert track is not None
    return np.linalg.norm(track.at(TIME_S)[:, :3] - PATH, axis=1)


@pytest.mark.parametrize("dme", [(0.0, 9000.0, 0.0), (0.0, 3000.0, 0.0)], ids=["behind the flight", "below it"])
def test_a_line_of_sight_that_meets_a_sphere_twice_follows_what_a_radar_sees_later(dme):
    theodolite = seen("theodolite", (0, -6000, 0), (1, 2))
    radar = seen("radar", (5000, 0, 0), (0, 1, 2), during=(30.0, 60.0))
    assert error_m([theodolite, seen("dme", dme, (0,)), radar]).max() < 30.0


def test_the_path_stays_with_the_radar_that_does_not_jump():
    steady = seen("one", (0, -6000, 0), (0, 1, 2))
    other = seen("two", (5000, 0, 0), (0, 1, 2), offset_m=400.0, away=(20.0, 40.0))
    for stations in ([steady, other], [other, steady]):
        assert np.median(error_m(stations)[45:75]) < 30.0


def test_of_many_stations_the_few_that_follow_another_target_do_not_lead():
    """Of 28 points that two lines of sight make, 12 are fitted; 18 of them are of a station that is elsewhere."""
    turn = 2 * np.pi * np.arange(8) / 8
    places = np.c_[6000 * np.cos(turn), 4000 + 6000 * np.sin(turn), np.zeros(8)]
    away = [seen(f"foe {k}", places[k], (1, 2), offset_m=900.0 * (k + 1), away=(0.0, 61.0)) for k in range(3)]
    right = [seen(f"theodolite {k}", places[k], (1, 2)) for k in range(3, 8)]
    for stations in ([*away, *right], [*right, *away]):
        assert np.median(error_m(stations)) < 30.0


def test_those_lead_that_are_often_among_the_best_of_a_moment():
    costs = np.random.default_rng(1).uniform(1, 2, (30, 50))
    best = [3, 4, 8, 11, 12, 13, 17, 20, 21, 25, 28, 29]
    costs[best] -= 1.0
    costs[best, ::3] += 2.0
    costs[5, :10], costs[6] = 0.0, np.inf  # the best for a while; nowhere
    leading = first_track._leading([np.full((50, 3), k) for k in range(30)], list(costs))
    assert {int(each[0, 0]) for each in leading} == set(best)


def test_readings_that_meet_nowhere_give_no_track():
    pair = [seen("one", (0, 0, 0), (0,)), seen("two", (900, 0, 0), (0,))]
    weight = [np.isfinite(each.measurement).astype(float) for each in pair]
    assert first_track.find(pair, weight, np.tile(SIGMA, (2, 1))) is None
