"""The figures of the summary against a count by hand, and the lines for the terminal."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from ftproc import pipeline
from ftproc.quality import summary
from ftproc.quality.verdict import NOT_SHOWN
from ftproc.records import GOOD, ISOLATED, MISSING, PATCH
from ftproc.settings import FilterSettings
from tests.simulated import simulate

COMPONENTS = ("range", "azimuth", "elevation")


@pytest.fixture(scope="module")
def dirty():
    spec = "isolated=0.03:10-200,offset=2:8-20:20-100,nan=0.02,gap=1:3-5,duplicates=4"
    flight = simulate("cruise", seed=1, duration_s=60.0, outliers=spec)
    return flight, pipeline.filter_log(flight.log)


def figures(trajectory):
    return trajectory.metadata["summary"]


def test_counts_are_those_of_the_labels(dirty):
    _, trajectory = dirty
    for c, name in enumerate(COMPONENTS):
        part = figures(trajectory)["components"][name]
        for key, label in (("good", GOOD), ("isolated", ISOLATED), ("patch", PATCH), ("missing", MISSING)):
            assert part[key] == (trajectory.outlier[:, c] == label).sum()
        assert part["good"] + part["isolated"] + part["patch"] + part["missing"] == len(trajectory)
        assert part["isolated"] > 0


def test_longest_patch_is_counted_by_walking_along(dirty):
    _, trajectory = dirty
    for c, name in enumerate(COMPONENTS):
        longest, begin = 0.0, None
        for time, label in zip(trajectory.time_s, trajectory.outlier[:, c], strict=True):
            if label == PATCH:
                begin = time if begin is None else begin
                longest = max(longest, time - begin)
            elif label != MISSING:
                begin = None
        assert figures(trajectory)["components"][name]["longest_patch_s"] == pytest.approx(longest)


def test_times_gaps_and_noise(dirty):
    flight, trajectory = dirty
    s, step = figures(trajectory), np.diff(flight.log.time_s)
    assert s["rows"] == len(flight.log)
    assert s["duration_s"] == pytest.approx(60.0)
    assert s["interval_s"] == pytest.approx(0.1)
    assert s["gaps"] == 1
    assert s["longest_gap_s"] == pytest.approx(step.max())
    assert s["duplicate_times"] == 4
    assert s["components"]["range"]["noise_m"] == pytest.approx(flight.sigma[0], rel=0.15)
    assert s["components"]["azimuth"]["noise_rad"] == pytest.approx(flight.sigma[1], rel=0.15)
    jerk = s["jerk_psd_m2ps5"]
    assert 0 < jerk["lowest"] <= jerk["median"] <= jerk["highest"]


def test_noise_shown_is_that_of_a_reading_even_if_correlated():
    flight = simulate("cruise", seed=0, duration_s=150.0, outliers="correlation=0.5")
    trajectory = pipeline.filter_log(flight.log)
    part = figures(trajectory)["components"]["range"]
    assert part["noise_m"] == pytest.approx(flight.sigma[0], rel=0.2)
    assert part["noise_correlation"] == pytest.approx(np.exp(-0.2), abs=0.06)
    assert "the noise is correlated between samples (coefficient up to 0.8" in summary.text(trajectory.metadata)


def test_a_consistent_filter(dirty):
    s = figures(dirty[1])
    for name in COMPONENTS:
        assert s["components"][name]["verdict"] == "consistent"
        assert s["components"][name]["innovation_ratio"] == pytest.approx(1, abs=0.2)
    assert s["nis_mean"] == pytest.approx(s["components_used_mean"], rel=0.15)
    assert 2.5 < s["components_used_mean"] <= 3


@pytest.mark.parametrize(("factor", "verdict"), [(0.3, "overconfident"), (1.0, "consistent"), (3.0, "cautious")])
def test_sigmas_of_a_specified_noise(factor, verdict):
    flight = simulate("cruise", seed=2, duration_s=60.0, outliers="none")
    noise = tuple(factor * s for s in flight.sigma)
    trajectory = pipeline.filter_log(flight.log, FilterSettings(editing="none", noise=noise, jerk_psd_m2ps5=1.0))
    verdicts = {part["verdict"] for part in figures(trajectory)["components"].values()}
    assert verdicts == {verdict}


def test_summary_is_json(dirty):
    text = json.dumps(summary.as_dict(dirty[1].metadata), allow_nan=False)
    again = json.loads(text)
    assert list(again)[:2] == ["log", "method"]
    assert again["rows"] == len(dirty[1])


def test_text_has_a_line_for_each_component(dirty):
    lines = summary.text(dirty[1].metadata).splitlines()
    assert lines[0].startswith(f"{dirty[0].log.name}: {len(dirty[1])} rows, 60 s, filtered by ga-bpnn-ukf (two-pass")
    for c, name in enumerate(COMPONENTS):
        (line,) = [line for line in lines if line.startswith(f"  {name} ")]
        part = figures(dirty[1])["components"][name]
        counts = line.split()[1:5]
        assert counts == [str(part[k]) for k in ("good", "isolated", "patch", "missing")]
        assert line.endswith("consistent")
        assert (" mrad " in line) == (c > 0)
        flagged = (dirty[1].outlier[:, c] == ISOLATED) | (dirty[1].outlier[:, c] == PATCH)
        there = dirty[1].outlier[:, c] != MISSING
        assert f" {100 * flagged.sum() / there.sum():.2f} % " in line
    (gaps,) = [line for line in lines if line.startswith("  gaps ")]
    assert gaps.split(None, 1)[1].startswith("1, the longest ")
    assert "  rows       4 rows share the time of the row before" in lines
    assert len(lines) < 16
    assert max(map(len, lines)) <= 120


def test_lines_stand_under_each_other(dirty):
    """Names are left-aligned, their texts start in one column, and the columns of the table end together."""
    _, header, *table = summary.text(dirty[1].metadata).splitlines()[:5]
    assert len({len(line) for line in (header, *table)}) == 1
    rest = summary.text(dirty[1].metadata).splitlines()[5:]
    assert {line[13] != " " and line[11:13] == "  " for line in rest} == {True}


def test_text_ends_with_the_verdict(dirty):
    lines = summary.text(dirty[1].metadata).splitlines()
    assert lines[-3:-1] == [
        "  verdict    consistent: residuals agree with the published sigmas, and no fault shows",
        f"             {NOT_SHOWN}",
    ]
    assert figures(dirty[1])["trust"] == {"verdict": "consistent", "reasons": [], "not_shown": NOT_SHOWN}


def test_text_reports_rows_without_time_and_out_of_order():
    flight = simulate("cruise", seed=3, duration_s=20.0, outliers="none")
    log = replace(flight.log, rows_without_time=(17, 40), rows_out_of_order=3, rows_in_file=len(flight.log) + 2)
    text = summary.text(pipeline.filter_log(log, FilterSettings(smooth=True)).metadata)
    assert "  rows       2 rows have no time (first: row 17)" in text
    assert "  rows       3 rows out of time order, sorted" in text
    assert "smoothed by" in text
    assert "  gaps       none\n" in text


def test_text_names_what_is_not_observable():
    flight = simulate("cruise", seed=3, duration_s=20.0, outliers="none")
    z = flight.log.measurement.copy()
    z[:, [0, 2]] = np.nan
    trajectory = pipeline.filter_log(replace(flight.log, measurement=z))
    text = summary.text(trajectory.metadata)
    assert "range and elevation missing throughout: position and velocity are not observable and left empty" in text
    parts = figures(trajectory)["components"]
    assert parts["range"]["noise_m"] is None
    assert [parts[name]["verdict"] for name in COMPONENTS] == [
        "not observable",
        parts["azimuth"]["verdict"],
        "not observable",
    ]


def test_text_reports_reacquisition_and_correction():
    flight = simulate("cruise", seed=2, duration_s=60.0, outliers="none")
    z = flight.log.measurement.copy()
    z[300:] += [800.0, 0.05, 0.0]
    trajectory = pipeline.filter_log(replace(flight.log, measurement=z), FilterSettings(editing="forward"))
    times = figures(trajectory)["reacquired"]
    assert times >= 1
    often = {1: "once", 2: "twice"}.get(times, f"{times} times")
    assert f"re-initialized {often} (track loss" in summary.text(trajectory.metadata)
    corrected = replace(
        trajectory,
        metadata={
            **trajectory.metadata,
            "summary": {
                **figures(trajectory),
                "correction_largest_m": 1.25,
                "correction_largest_sigma": 0.5,
                "correction_outside_training": 0.125,
            },
        },
    )
    text = "network correction up to 1.25 m, 0.5 sigma; none for the 12.5 % of samples outside its training data"
    assert text in summary.text(corrected.metadata)
    undecided = replace(
        trajectory, metadata={**trajectory.metadata, "summary": {**figures(trajectory), "editing_converged": False}}
    )
    assert "did not converge" in summary.text(undecided.metadata)
    slow = replace(
        trajectory, metadata={**trajectory.metadata, "summary": {**figures(trajectory), "slow_noise_s": 3.0}}
    )
    assert "correlated over 3 s explains the log as well as motion does" in summary.text(slow.metadata)


def test_single_row():
    flight = simulate("cruise", seed=3, duration_s=20.0, outliers="none")
    log = replace(
        flight.log, time_s=flight.log.time_s[:1], measurement=flight.log.measurement[:1], row=np.arange(1)
    )  # fmt: skip
    s = figures(pipeline.filter_log(log))
    assert (s["rows"], s["duration_s"], s["interval_s"], s["gaps"], s["longest_gap_s"]) == (1, 0.0, 0.0, 0, 0.0)
    assert ": 1 row, 0 s" in summary.text(pipeline.filter_log(log).metadata)
