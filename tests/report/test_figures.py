"""The figures, read back from plotly's objects."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest

from ftproc.errors import UsageError
from ftproc.records import ISOLATED, MISSING, PATCH
from ftproc.report import plot, readings, style, thinning
from ftproc.report.page import FIGURES
from ftproc.report.readings import NOT_KNOWN
from ftproc.report.timeplots import errors
from ftproc.report.view import view
from tests.report.flights import angles_only, filtered, flight, one_row, position_only

NAMES = {flag: kind.name for flag, kind in style.KINDS.items()}


def traces(figure, name):
    return [trace for trace in figure.data if trace.name == name]


def drawn(trajectory, what):
    return FIGURES[what](view(trajectory))


@pytest.mark.parametrize("what", list(FIGURES))
@pytest.mark.parametrize("make", [filtered, one_row, angles_only, position_only], ids=lambda make: make.__name__)
def test_every_figure_of_every_kind_of_trajectory(make, what):
    """A figure with at least one finite point, or a sentence that says why there is none."""
    found = drawn(make(), what)
    if found.figure is None:
        assert found.note.endswith(".")
    else:
        assert any(np.isfinite(np.asarray(trace.y, float)).any() for trace in found.figure.data)


def test_which_figures_there_are_without_range_or_readings():
    there = {what for what in FIGURES if drawn(angles_only(), what).figure is not None}
    assert there == {"readings", "worst", "residuals", "nis", "sigmas"}
    axes = drawn(angles_only(), "readings").figure.layout
    assert [axes.yaxis.title.text, axes.yaxis2.title.text] == ["A, deg", "E, deg"]
    read = replace(filtered(), diagnostics=None)
    assert drawn(read, "residuals") == (None, NOT_KNOWN)
    assert drawn(read, "readings").note.startswith(NOT_KNOWN)
    assert {what for what in FIGURES if drawn(position_only(), what).figure is not None} == {
        "track",
        "ground",
        "motion",
    }


def test_every_flagged_reading_is_marked_where_it_is():
    made, figure = filtered(), drawn(filtered(), "readings").figure
    channels = view(made).channels
    for flag in (ISOLATED, PATCH):
        for c, trace in enumerate(traces(figure, NAMES[flag])):
            rows = made.outlier[:, c] == flag
            np.testing.assert_array_equal(trace.x, made.time_s[rows])
            value = trace.y if trace.customdata is None else trace.customdata
            np.testing.assert_allclose(value, channels[c].reading[rows], rtol=1e-6)
            low, high = np.nanmin(channels[c].cleaned), np.nanmax(channels[c].cleaned)
            room = 0.5 * (high - low) + 20
            assert low - room < np.min(trace.y) <= np.max(trace.y) < high + room
    assert sum(len(trace.x) for trace in traces(figure, NAMES[MISSING])) == (made.outlier == MISSING).sum()
    assert len({tuple(trace.marker.symbol) for flag in NAMES for trace in traces(figure, NAMES[flag])}) == 3
    assert len({trace.marker.color for flag in NAMES for trace in traces(figure, NAMES[flag])}) == 3


def test_an_outlier_far_away_stands_at_the_edge_and_tells_its_value():
    made = filtered()
    row = int(np.flatnonzero(made.outlier[:, 0] == ISOLATED)[0])
    reading = made.diagnostics.reading.copy()
    reading[row, 0] = 1e9
    far = replace(made, diagnostics=replace(made.diagnostics, reading=reading))
    trace = traces(drawn(far, "readings").figure, NAMES[ISOLATED])[0]
    at = list(trace.x).index(made.time_s[row])
    assert trace.y[at] < 1e6
    assert trace.customdata[at] == pytest.approx(1e9)
    assert "customdata" in trace.hovertemplate


def test_too_many_marks_are_thinned_and_counted(monkeypatch):
    monkeypatch.setattr(readings, "MOST_MARKED", 50)
    monkeypatch.setattr(thinning.Timeline.of.__func__, "__defaults__", (40,))
    found = drawn(filtered(), "readings")
    total = int((filtered().outlier > 0).sum())
    marked = sum(len(trace.x) for name in NAMES.values() for trace in traces(found.figure, name))
    assert 50 < marked < total
    assert f"Of {total:,} flagged readings {marked:,} are marked, the extremes of each pixel column." in found.note


@pytest.mark.parametrize("what", list(FIGURES))
def test_a_name_is_once_in_the_legend(what):
    figure = drawn(filtered(), what).figure
    if figure is not None and figure.layout.showlegend is not False:
        shown = [trace.name for trace in figure.data if trace.showlegend is not False]
        assert len(shown) == len(set(shown)) > 0


def test_residuals_are_in_sigmas_with_the_gate():
    for smooth, word in ((False, "Innovation:"), (True, "Leave-one-out residual:")):
        made = filtered(smooth)
        found = drawn(made, "residuals")
        assert found.note.startswith(word)
        good = np.concatenate([trace.y for trace in traces(found.figure, "good reading")])
        assert np.std(good) == pytest.approx(1, abs=0.15)
        gates = {float(trace.y[0]) for trace in traces(found.figure, "gate of 4 sigmas")}
        assert gates == {-4.0, 4.0}
        off = np.concatenate([np.abs(trace.y) for trace in traces(found.figure, NAMES[ISOLATED])])
        assert (off <= 12).all()
        assert np.median(off) > 4


def test_nis_means_lie_between_their_bounds():
    figure = drawn(filtered(), "nis").figure
    (mean,) = traces(figure, "mean over an interval")
    low, high = traces(figure, "bounds")
    there = np.isfinite(mean.y)
    assert ((low.y <= mean.y) & (mean.y <= high.y))[there].mean() > 0.9
    (expected,) = traces(figure, "expected")
    assert np.nanmean(expected.y) == pytest.approx(filtered().metadata["summary"]["components_used_mean"], rel=0.05)


def test_ground_track_is_drawn_at_equal_scales_with_north_up():
    layout = drawn(filtered(), "ground").figure.layout
    assert (layout.yaxis.scaleanchor, layout.yaxis.scaleratio) == ("x", 1)
    assert layout.xaxis.title.text == "x, m"
    north = replace(filtered(), metadata={**filtered().metadata, "frame": "north-east-up"})
    figure = drawn(north, "ground").figure
    assert figure.layout.xaxis.title.text == "y (east), m"
    path = np.asarray(next(trace for trace in figure.data if trace.name == "estimate").y, float)
    assert np.nanmax(path) == pytest.approx(np.nanmax(filtered().state[:, 0]), rel=1e-6)


def test_track_says_how_much_heights_are_enlarged():
    low = 0.05 * np.ptp(filtered().state[:, :2], axis=0).max() / np.ptp(filtered().state[:, 2])
    flat = replace(filtered(), state=filtered().state * [1, 1, low, 1, 1, 1, 1, 1, 1])
    found = drawn(flat, "track")
    ratio = found.figure.layout.scene.aspectratio
    size = np.ptp(flat.state[:, :3], axis=0)
    raised = (ratio.z / size[2]) / (ratio.y / size[1])
    assert f"heights enlarged {float(f'{raised:.2g}'):g} times" in found.note
    tall = replace(filtered(), state=filtered().state * [1, 1, 9, 1, 1, 1, 1, 1, 1])
    ratio, size = drawn(tall, "track").figure.layout.scene.aspectratio, np.ptp(tall.state[:, :3], axis=0)
    assert ratio.z / size[2] == pytest.approx(ratio.y / size[1])


def test_correction_is_drawn_where_there_is_one():
    assert "No network correction" in drawn(filtered(), "correction").note
    added = np.zeros((len(filtered()), 6))
    added[3] = 2.0
    assert drawn(replace(filtered(), correction=added), "correction").figure is not None


def test_sigmas_of_position_velocity_and_acceleration_are_drawn():
    made, figure = filtered(), drawn(filtered(), "sigmas").figure
    axes = [figure.layout[f"yaxis{k}"].title.text for k in ("", "2", "3")]
    assert axes == ["σ position, m", "σ velocity, m/s", "σ acceleration, m/s²"]
    assert len(figure.data) == 9
    for k, trace in enumerate(figure.data):
        assert trace.name == "xyz"[k % 3]
        assert np.nanmax(trace.y) == pytest.approx(np.nanmax(made.sigma[:, k]), rel=1e-6)


def test_sigmas_of_a_log_of_angles_are_those_of_its_cleaned_readings():
    made, found = angles_only(), drawn(angles_only(), "sigmas")
    assert found.figure.layout.yaxis.title.text == "σ A, mrad"
    assert [trace.name for trace in found.figure.data] == ["azimuth", "elevation"]
    assert np.nanmax(found.figure.data[1].y) == pytest.approx(1e3 * made.measurement_sigma[:, 2].max(), rel=1e-6)
    assert "the position is not observable" in found.note


def test_errors_are_drawn_with_three_published_sigmas():
    found = errors(view(filtered(), flight().truth)).figure
    error, limit = traces(found, "error"), traces(found, "3 sigmas")
    assert (len(error), len(limit)) == (9, 18)
    np.testing.assert_allclose(np.asarray(limit[1].y), -np.asarray(limit[0].y))
    late = replace(flight().truth, time_s=flight().truth.time_s + 1e6)
    of_angles = errors(view(angles_only(), flight().truth)).figure
    assert [axis.title.text for axis in (of_angles.layout.yaxis, of_angles.layout.yaxis2)] == [
        "error in A, mrad",
        "error in E, mrad",
    ]
    assert (len(traces(of_angles, "error")), len(traces(of_angles, "3 sigmas"))) == (2, 4)
    assert "do not overlap" in errors(view(filtered(), late)).note
    assert errors(view(filtered())).figure is None


def test_plot_in_a_notebook():
    import plotly.graph_objects as go

    assert isinstance(plot(filtered()), go.Figure)
    assert plot(filtered(), "sigmas").layout.yaxis.type == "log"
    with pytest.raises(UsageError, match="there is no figure 'map'; there are track, ground, readings"):
        plot(filtered(), "map")
    with pytest.raises(UsageError, match="There is no position to draw"):
        plot(angles_only())


def test_without_plotly(monkeypatch):
    monkeypatch.setitem(sys.modules, "plotly.graph_objects", None)
    with pytest.raises(UsageError, match=r'reports need plotly, which is not installed: pip install "plotly>=6.0"'):
        plot(filtered())
