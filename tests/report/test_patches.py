"""The table of outlier patches, and the seconds with most outliers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ftproc import report
from ftproc.records import COMPONENTS, GOOD, ISOLATED, MISSING, PATCH, Trajectory
from ftproc.report import tables
from ftproc.report.patches import WORST_S, patches, worst
from ftproc.report.view import view
from tests.report.flights import filtered


def flagged(**runs: tuple[int, int]) -> Trajectory:
    """The flight with no flags but patches of these rows, per component."""
    made = filtered()
    outlier = np.full_like(made.outlier, GOOD)
    for name, (first, end) in runs.items():
        outlier[first:end, COMPONENTS.index(name)] = PATCH
    return replace(made, outlier=outlier)


def test_each_patch_has_its_times_component_and_size() -> None:
    made = flagged(range=(20, 30), elevation=(5, 9))
    reading = made.measurement.copy()
    reading[20:30, 0] += 150.0
    reading[5:9, 2] -= 3e-3
    assert made.diagnostics is not None
    made = replace(made, diagnostics=replace(made.diagnostics, reading=reading))
    first, second = patches(view(made))
    assert (first.component, first.start_s, first.end_s, first.readings) == ("elevation", *made.time_s[[5, 8]], 4)
    assert (first.size, first.unit) == (pytest.approx(-3.0), "mrad")
    assert (second.component, second.start_s, second.end_s, second.readings) == ("range", *made.time_s[[20, 29]], 10)
    assert (second.size, second.unit) == (pytest.approx(150.0), "m")
    page = tables.patches(view(made))
    assert f'data-from="{float(made.time_s[20])!r}"' in page
    assert "+150 m" in page
    assert "-3 mrad" in page


def test_missing_readings_inside_do_not_end_a_patch() -> None:
    made = flagged(azimuth=(20, 30))
    made.outlier[24, 1] = MISSING
    (only,) = patches(view(made))
    assert (only.start_s, only.end_s, only.readings) == (made.time_s[20], made.time_s[29], 9)
    made.outlier[24, 1] = GOOD
    assert len(patches(view(made))) == 2


def test_without_patches_and_without_raw_readings() -> None:
    assert tables.patches(view(flagged())) == ""
    (only,) = patches(view(replace(flagged(range=(3, 6)), diagnostics=None)))
    assert np.isnan(only.size)


def test_the_worst_seconds_hold_most_outliers() -> None:
    made = flagged()
    time_s = made.time_s
    assert worst(view(made)) is None
    made.outlier[np.searchsorted(time_s, time_s[0] + 20), 0] = ISOLATED
    for k in range(4):
        made.outlier[np.searchsorted(time_s, time_s[0] + 30 + k), k % 3] = ISOLATED
    found = worst(view(made))
    assert found is not None
    assert found[1] - found[0] == pytest.approx(WORST_S)
    assert found[0] <= time_s[0] + 30
    assert found[1] >= time_s[0] + 33
    figure = report.plot(made, "worst")
    shown = np.concatenate([np.asarray(trace.x) for trace in figure.data])
    assert shown.min() >= found[0]
    assert shown.max() <= found[1]


@pytest.mark.parametrize("height", [0.0, 1.0, 50.0, 2000.0, 1e5])
def test_heights_are_enlarged_ten_times_at_most(height: float) -> None:
    made = filtered()
    state = made.state.copy()
    state[:, 2] = 1000 + height * np.linspace(0, 1, len(state))
    scene = report.plot(replace(made, state=state), "track").layout.scene
    x, y = (np.ptp(state[:, axis]) for axis in (0, 1))
    low, high = scene.zaxis.range
    assert low < state[:, 2].min() <= state[:, 2].max() < high
    widest = max(x, y, height)
    enlarged = (scene.aspectratio.z / (high - low)) / (max(scene.aspectratio.x, scene.aspectratio.y) / max(x, y))
    assert enlarged <= 10.01
    if widest == height:
        assert enlarged == pytest.approx(1.0, rel=0.06)
