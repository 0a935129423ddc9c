"""The extremes of a flight."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import ftproc
from ftproc.derived.extremes import extremes
from ftproc.settings import FilterSettings


@pytest.fixture(scope="module")
def flight():
    return ftproc.simulate("manoeuvre", seed=2, duration_s=60.0)


@pytest.fixture(scope="module")
def found(flight):
    return ftproc.filter_log(flight.log, FilterSettings(smooth=True))


def test_they_are_near_those_of_the_truth(flight, found):
    by = {each.what: each for each in extremes(found)}
    speed = np.linalg.norm(flight.truth.velocity_mps, axis=1)
    assert by["greatest speed"].value == pytest.approx(speed.max(), abs=3)
    assert by["least speed"].value == pytest.approx(speed.min(), abs=3)
    distance = np.linalg.norm(flight.truth.position_m, axis=1)
    closest = by["closest approach"]
    assert closest.value == pytest.approx(distance.min(), abs=5)
    assert closest.time_s == pytest.approx(flight.truth.time_s[distance.argmin()], abs=0.5)
    assert by["highest over the station"].value == pytest.approx(flight.truth.position_m[:, 2].max(), abs=5)
    assert all(each.sigma > 0 and each.time_s == found.time_s[each.row] for each in by.values())
    assert by["greatest load factor"].unit == "g"


def test_rows_that_are_far_vaguer_than_usual_are_no_extremes(found):
    state, sigma, path = found.state.copy(), found.sigma.copy(), found.path_sigma.copy()
    state[0, 3:6], sigma[0], path[0] = 5000.0, 1e4, 1e4
    by = {each.what: each for each in extremes(replace(found, state=state, sigma=sigma, path_sigma=path))}
    assert by["greatest speed"].value < 1000


def test_without_velocities_and_positions_there_are_none(found):
    assert [each.what for each in extremes(replace(found, state=np.full_like(found.state, np.nan)))] == [
        "closest approach", "greatest distance",
    ]  # fmt: skip
    nothing = replace(
        found, state=np.full_like(found.state, np.nan), measurement=np.full_like(found.measurement, np.nan)
    )
    assert extremes(nothing) == []
