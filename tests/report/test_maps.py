"""The map: raw positions, ticks of time, and the grid of latitude and longitude."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pymap3d
import pytest

from ftproc.files.moments import Moments
from ftproc.report.maps import graticule, ticks
from ftproc.report.maps.track import ground
from ftproc.report.view import view
from tests.report.flights import filtered, position_only

SITE = (48.0812, 11.2803, 612.0)


def traces(made):
    return {trace.name: trace for trace in ground(view(made)).figure.data}


def test_raw_positions_lie_on_the_track_and_those_with_outliers_are_named():
    found = traces(filtered())
    good = np.column_stack([found["raw position"].x, found["raw position"].y]).astype(float)
    made = filtered()
    away = np.linalg.norm(made.state[None, :, :2] - good[:, None], axis=2).min(1)
    assert len(good) > 300
    assert np.median(away) < 5
    bad = np.isin(made.outlier, (1, 2)).any(1)
    assert 0 < len(found["with an outlier"].x) <= bad.sum()  # some lie outside
    assert "raw position" not in traces(position_only())


def test_outliers_do_not_shrink_the_track():
    made = filtered()
    reading = made.diagnostics.reading.copy()
    reading[100, 0] = 1e6
    far = replace(made, diagnostics=replace(made.diagnostics, reading=reading))
    limits = [ground(view(each)).figure.layout.xaxis.range for each in (made, far)]
    assert limits[0] == limits[1]


@pytest.mark.parametrize(
    ("epoch", "start_s", "span_s", "said"),
    [
        ("", 0.0, 60.0, ["0 s", "10 s", "20 s", "30 s", "40 s", "50 s", "60 s"]),
        ("", 50_641.9, 60.0, ["T+0", "T+10", "T+20", "T+30", "T+40", "T+50", "T+60"]),
        ("2024-05-25T00:00:00Z", 43_430.0, 60.0, ["12:03:50", *(f"12:04:{s}0" for s in range(5))]),
        ("", 0.0, 0.9, ["0.0 s", "0.1 s", "0.2 s", "0.3 s", "0.4 s", "0.5 s", "0.6 s", "0.7 s", "0.8 s", "0.9 s"]),
    ],
)  # fmt: skip
def test_ticks_are_round_moments(epoch, start_s, span_s, said):
    time_s = start_s + np.linspace(0, span_s, 601)
    rows, found = ticks.along(Moments(epoch, start_s, start_s + span_s), time_s)
    assert found[: len(said)] == said[: len(found)]
    assert len(found) >= len(said) - 1
    assert (np.diff(rows) > 0).all()


def test_names_of_ticks_that_would_overlap_are_left_out():
    said = ["15:33:00", "15:33:10", "15:33:20", "15:33:30", "15:33:40"]
    place = np.array([[0.0, 0.0], [30.0, 2.0], [60.0, 4.0], [60.0, 30.0], [np.nan, 0.0]])
    assert ticks.apart(said, place) == ["15:33:00", "", "15:33:20", "15:33:30", ""]


def test_no_tick_stands_in_a_gap_or_for_a_single_row():
    time_s = np.r_[np.arange(0, 20.0), np.arange(50, 60.0)]
    rows, found = ticks.along(Moments("", 0.0, 59.0), time_s)
    assert not any(text in found for text in ("30 s", "40 s"))
    assert (np.abs(time_s[rows] - [float(text.split()[0]) for text in found]) < 2.5).all()
    assert ticks.along(Moments("", 5.0, 5.0), np.array([5.0]))[1] == []


def test_the_grid_is_that_of_latitude_and_longitude():
    made = filtered()
    settings = {**made.metadata["settings"], "site": list(SITE)}
    figure = ground(view(replace(made, metadata={**made.metadata, "settings": settings}))).figure
    names = [note.text for note in figure.layout.annotations]
    assert any(name.endswith("N") for name in names)
    assert any(name.endswith("E") for name in names)
    grid = [trace for trace in figure.data if trace.line.dash == "dot"]
    assert len(grid) == len(names)
    constant = 0
    for trace in grid:
        places = pymap3d.enu2geodetic(np.asarray(trace.x, float), np.asarray(trace.y, float), 0.0, *SITE)
        constant += sum(np.ptp(each) < 1e-5 for each in places[:2])
    assert constant == len(grid)
    assert not [t for t in ground(view(made)).figure.data if t.line.dash == "dot"]  # without a site


@pytest.mark.parametrize(
    ("degrees", "latitude", "step", "said"),
    [
        (48.0, True, 1.0, "48°N"),
        (-48.5, True, 1 / 6, "48°30'S"),
        (11.2575, False, 1 / 240, "11°15'27\"E"),
        (-0.5, False, 0.5, "0°30'W"),
    ],
)
def test_degrees_in_words(degrees, latitude, step, said):
    assert graticule.said(degrees, latitude, step) == said
