"""Conventions and known errors of a station, each undone to the last digits."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pyarrow as pa
import pytest

from ftproc.core.model import refraction
from ftproc.core.model.frames import to_cartesian
from ftproc.errors import InputError, UsageError
from ftproc.files import conventions
from ftproc.files.reading import logs
from ftproc.records import MeasurementLog
from ftproc.settings import Air, Station

TRUE = np.array([[1000.0, 0.3, 0.2], [2000.0, 3.0, 0.7], [np.nan, -2.0, np.nan]])


def log(measurement):
    return MeasurementLog("t", np.arange(float(len(measurement))), measurement, np.arange(len(measurement)))


def test_nothing_known_changes_no_bit():
    found = conventions.apply(log(np.array([[0.0, -0.0, 1e-300]])), Station())
    assert np.signbit(found.measurement[0, 1])
    assert found.measurement[0, 2] == 1e-300


def test_everything_at_once():
    """Zenith angles, an azimuth anticlockwise from a mark 2 rad east of north, biases and a late clock."""
    bias = (5.0, 0.01, -0.02)
    read = np.column_stack([TRUE[:, 0], 2.0 - TRUE[:, 1], math.pi / 2 - TRUE[:, 2]]) + bias
    station = Station("north", "anticlockwise", 2.0, "zenith", bias, 0.25)
    found = conventions.apply(log(read), station)
    np.testing.assert_allclose(found.measurement, TRUE, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(found.time_s, [0.25, 1.25, 2.25])
    assert (found.frame, found.station) == ("north-east-up", station)
    assert conventions.in_words(station) == [
        "range bias of 5 m subtracted", "azimuth bias of 10 mrad subtracted",
        "zenith angle bias of -20 mrad subtracted",
        "0.25 s added to the time", "azimuth counted anticlockwise from north, reversed",
        "azimuth zero at 114.591559 deg from north", "elevation from zenith angles",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("azimuth_from", "sense", "turned"),
    [("x", None, 1), ("x", "anticlockwise", 1), ("x", "clockwise", -1), ("north", "clockwise", 1),
     ("north", "anticlockwise", -1), ("north", None, 1)],
)  # fmt: skip
def test_sense(azimuth_from, sense, turned):
    found = conventions.apply(log(TRUE), Station(azimuth_from, sense))
    np.testing.assert_array_equal(found.measurement[:, 1], turned * TRUE[:, 1])


def test_sense_as_seen_from_above():
    """A target flies from x to y. In the frame `local` (x east, y north, z up) that is anticlockwise from above; with
    x north and y east it is clockwise."""
    x_to_y = to_cartesian(np.array([[1.0, 0.0, 0.0], [1.0, math.pi / 2, 0.0]]))
    for azimuth_from, (east, north), sense in (("x", (0, 1), "anticlockwise"), ("north", (1, 0), "clockwise")):
        on_map = x_to_y[:, [east, north]]
        turn = on_map[0, 0] * on_map[1, 1] - on_map[0, 1] * on_map[1, 0]
        assert (turn > 0) == (sense == "anticlockwise")
        own = conventions.apply(log(TRUE), Station(azimuth_from, sense)).measurement
        np.testing.assert_array_equal(own, TRUE)


def test_refraction_is_subtracted_by_the_distance():
    air = Air(30.0, 900.0)
    found = conventions.apply(log(TRUE[:2]), Station(refraction=air)).measurement
    expected = refraction.elevation_error(TRUE[:2, 0], TRUE[:2, 2], 30.0, 900.0)
    np.testing.assert_allclose(TRUE[:2, 2] - found[:, 2], expected, rtol=1e-9)
    assert conventions.in_words(Station(refraction=air)) == ["refraction of light corrected for 30 deg C and 900 hPa"]


def test_an_outlier_or_missing_range_does_not_change_the_refraction():
    readings = np.column_stack([np.full(40, 30e3), np.zeros(40), np.full(40, 0.1)])
    calm = conventions.apply(log(readings), Station(refraction=Air())).measurement
    readings[7, 0], readings[20, 0], readings[0, 0], readings[39, 0] = 0.0, 9e9, np.nan, np.nan
    found = conventions.apply(log(readings), Station(refraction=Air())).measurement
    np.testing.assert_array_equal(found[:, 2], calm[:, 2])


def test_without_any_range_the_target_is_outside_the_air():
    readings = np.array([[np.nan, 0.0, math.pi / 4]])
    found = conventions.apply(log(readings), Station(refraction=Air())).measurement
    assert math.pi / 4 - found[0, 2] == pytest.approx(refraction.REFRACTIVITY, rel=5e-3)


@pytest.mark.parametrize(
    ("wrong", "sentence"),
    [
        ({"azimuth_from": "south"}, '--azimuth-from: "south" is not understood; say x or north.'),
        ({"elevation_from": "nadir"}, '--elevation-from: "nadir" is not understood; say horizon or zenith.'),
        ({"azimuth_sense": "left"}, 'The azimuth\'s sense is clockwise or anticlockwise, not "left".'),
    ],
)
def test_words_that_are_not_understood(wrong, sentence):
    with pytest.raises(UsageError) as caught:
        conventions.apply(log(TRUE), replace(Station(), **wrong))
    assert str(caught.value) == sentence


def table(**columns):
    return pa.table({"time_s": [0.0, 1.0], "range_m": [5.0, 6.0], **columns})


def test_a_column_of_zenith_angles_is_known_by_its_name():
    found = logs.read(table(zenith_gon=[90.0, 80.0]))
    assert found.station.elevation_from == "zenith"
    assert "elevation from zenith angles" in found.understood["conventions"]
    np.testing.assert_allclose(found.measurement[:, 2], [math.pi / 20, math.pi / 10], rtol=1e-12)
    for elevation_from in ("zenith", None):
        station = Station(elevation_from=elevation_from)
        again = logs.read(table(zenith_gon=[90.0, 80.0]), columns="elevation=zenith_gon", station=station)
        np.testing.assert_array_equal(again.measurement, found.measurement)
    other = logs.read(table(zenith_gon=[90.0, 80.0]), station=Station(elevation_from="horizon"))
    np.testing.assert_allclose(other.measurement[:, 2], [math.pi * 0.45, math.pi * 0.4], rtol=1e-12)
    without = logs.read(table(zenith_gon=[90.0, 80.0]), columns="elevation=none")
    assert "elevation" not in without.understood["columns"]


def test_a_zenith_angle_may_be_more_than_a_right_angle_but_not_two():
    station = Station(elevation_from="zenith")
    found = logs.read(table(elevation_rad=[1.7, 1.8]), station=station).measurement
    assert found[0, 2] == pytest.approx(math.pi / 2 - 1.7, rel=1e-12)
    with pytest.raises(InputError, match="which is no zenith angle"):
        logs.read(table(elevation_rad=[95.0, 96.0]), station=station)
