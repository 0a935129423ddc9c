"""Steps that were bridged, in the page: the verdict, the table, and a line with a label in each figure over time."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from ftproc import pipeline, report
from ftproc.records import COMPONENTS, PATCH, Trajectory
from ftproc.report import tables
from ftproc.report.page import page
from ftproc.report.patches import steps
from ftproc.report.view import view
from ftproc.settings import FilterSettings
from ftproc.simulation import simulate
from tests.report.flights import filtered

OVER_TIME = ("nis", "sigmas", "motion")


@pytest.fixture(scope="module")
def stepped() -> Trajectory:
    """A clean flight whose azimuth slips by -4.1 mrad after 35 of 60 s."""
    log = simulate("manoeuvre", seed=5, duration_s=60.0, outliers="none").log
    z = log.measurement.copy()
    z[log.time_s - log.time_s[0] >= 35, 1] -= 4.1e-3
    return pipeline.filter_log(replace(log, measurement=z), FilterSettings(smooth=True))


def with_steps(*found: dict) -> Trajectory:
    made = filtered()
    summary = {**made.metadata["summary"], "steps": list(found)}
    return replace(made, metadata={**made.metadata, "summary": summary}, outlier=np.zeros_like(made.outlier))


def lines(made: Trajectory, what: str) -> dict[str, tuple[float, str]]:
    """Upright lines of a figure: time and label by the axis that they cross."""
    layout = report.plot(made, what).layout
    label = {note.yref.removesuffix(" domain"): note.text for note in layout.annotations}
    crossed = [(shape.yref.removesuffix(" domain"), shape.x0, shape.x1) for shape in layout.shapes]
    assert all(start == end for _, start, end in crossed)
    return {axis: (start, label.get(axis, "")) for axis, start, _ in crossed}


def test_a_step_is_named_in_the_page_the_table_and_the_figures(stepped: Trajectory) -> None:
    (step,) = steps(view(stepped))
    assert step.component == "azimuth"
    assert step.time_s == pytest.approx(stepped.time_s[0] + 35, abs=0.3)
    assert re.fullmatch(r"azimuth steps by -(3\.9|4|4\.0|4\.1|4\.2)\d* mrad at [\d.]+ s", step.words)
    text = page(stepped)
    assert re.search(rf"suspect: {re.escape(step.words)}: the estimate follows the longer side", text)
    assert (
        f">{step.time_s:,.2f}</button></td><td></td><td>stays</td><td>azimuth, a step</td><td>-</td><td>{step.size}<"
        in text
    )
    for what in ("readings", "residuals"):  # of the azimuth alone
        assert lines(stepped, what) == {"y2": (step.time_s, step.words)}
    for what in OVER_TIME:
        found = lines(stepped, what)
        assert found["y"] == (step.time_s, step.words)
        assert set(found.values()) <= {(step.time_s, step.words), (step.time_s, "")}


def test_a_jump_of_the_clock_crosses_all_components() -> None:
    made = with_steps({"component": "clock", "time_s": float(filtered().time_s[300]), "size_s": -0.5, "sigma_s": 0.02})
    (step,) = steps(view(made))
    assert step.words == f"the clock jumps by -0.5 s at {made.time_s[300]:.6g} s"
    for what in ("readings", "residuals"):
        assert lines(made, what) == dict.fromkeys(("y", "y2", "y3"), (made.time_s[300], step.words))
    assert "<td>clock, a step</td><td>-</td><td>-0.5 s</td>" in tables.patches(view(made))


def test_many_steps_have_labels_at_different_heights_inside_the_plot() -> None:
    times = filtered().time_s[[100, 102, 104]]
    made = with_steps(*({"component": "range", "time_s": float(t), "size_m": 90.0, "sigma_m": 1.0} for t in times))
    notes = report.plot(made, "nis").layout.annotations
    assert len({note.yshift for note in notes}) == 3
    assert {note.xanchor for note in notes} == {"left"}  # where the room is
    late = with_steps({"component": "range", "time_s": float(made.time_s[-5]), "size_m": 90.0, "sigma_m": 1.0})
    assert report.plot(late, "nis").layout.annotations[0].xanchor == "right"


def test_steps_stand_before_patches_and_without_them() -> None:
    made = with_steps({"component": "range", "time_s": float(filtered().time_s[90]), "size_m": 90.0, "sigma_m": 1.0})
    assert "<h2>Steps</h2>" in tables.patches(view(made))
    made.outlier[20:30, COMPONENTS.index("range")] = PATCH
    text = tables.patches(view(made))
    assert "<h2>Steps and outlier patches</h2>" in text
    assert text.index("range, a step") < text.index("<td>10</td>")
    assert "Steps" not in tables.patches(view(replace(filtered())))


def test_no_step_no_line_and_none_outside_the_seconds_shown() -> None:
    made = filtered()
    assert not report.plot(made, "residuals").layout.shapes
    summary = {**made.metadata["summary"], "steps": [
        {"component": "range", "time_s": float(made.time_s[-1]), "size_m": 90.0, "sigma_m": 1.0}
    ]}  # fmt: skip
    late = replace(made, metadata={**made.metadata, "summary": summary})
    assert report.plot(late, "readings").layout.shapes
    assert not report.plot(late, "worst").layout.shapes


def test_readings_that_were_not_measured_and_one_sided_errors_are_said_in_the_page() -> None:
    log = simulate("manoeuvre", seed=6, duration_s=60.0, outliers="none").log
    z = log.measurement.copy()
    z[:, 2] = z[np.arange(len(z)) // 4 * 4, 2]
    rng = np.random.default_rng(3)
    some = rng.random(len(z)) < 0.5
    z[some, 0] += rng.exponential(15.0, int(some.sum()))
    text = page(pipeline.filter_log(replace(log, measurement=z), FilterSettings(smooth=True)))
    assert re.search(
        r"elevation repeats the reading before in \d+ rows: these count as missing, and \d+ readings", text
    )
    assert re.search(r"range errors lie on one side in about \d\d % of the readings, by \+\d", text)
