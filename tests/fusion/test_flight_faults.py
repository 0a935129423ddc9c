"""When the stations of a fused flight contradict each other, and what is then left alone."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from ftproc.fusion.estimation import flight_faults


def current(used=(0.9, 0.9), possible=(1, 1), noise=1.0, unexamined=0):
    """A settled flight of two stations. used: share of the readings of each; possible: whether it takes part."""
    n = 100
    weight = [np.repeat((np.arange(n) < share * n).astype(float)[:, None], 3, 1) for share in used]
    return SimpleNamespace(
        stations=[SimpleNamespace(measurement=np.ones((n, 3))) for _ in used],
        weight=[each * part for each, part in zip(weight, possible, strict=True)],
        possible=[np.full((n, 3), float(part)) for part in possible],
        sigma=np.full((2, 3), noise), own=np.ones((2, 3)), unexamined=unexamined,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("changed", "contradict"),
    [
        ({}, False),
        ({"used": (0.9, 0.4)}, True),
        ({"possible": (0, 1)}, False),  # it was left out
        ({"possible": (0, 1), "used": (0.9, 0.4)}, True),
        ({"noise": 2.5}, True),
        ({"unexamined": 1}, True),
    ],
)
def test_stations_contradict_each_other_where_one_that_takes_part_is_rejected_or_noisier(changed, contradict):
    assert flight_faults._contradict(current(**changed)) is contradict


@pytest.mark.parametrize(("contradict", "expected"), [(True, ("white-jerk",)), (False, ("white-jerk", "orbital"))])
def test_stations_that_contradict_each_other_tell_no_motion(monkeypatch, contradict, expected):
    found, asked = SimpleNamespace(unexamined=1, stations=[], weight=[]), []
    monkeypatch.setattr(flight_faults, "_contradict", lambda _: contradict)
    monkeypatch.setattr(flight_faults, "_without_largest_jumps", lambda readings, settle: (readings, found))
    monkeypatch.setattr(flight_faults.lasting.Readings, "of", lambda _: None)
    monkeypatch.setattr(flight_faults.beside, "fitted", lambda flight, *_: flight)
    monkeypatch.setattr(flight_faults.engine, "last", lambda flight, names: asked.append(names) or flight)
    found.events, found._replace = SimpleNamespace(time_s=np.zeros(3)), lambda **_: found
    assert flight_faults.fuse([], 3.0, None, ("white-jerk", "orbital"), None, print) is found
    assert asked == [expected]
