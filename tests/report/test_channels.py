"""Range rates and heights in the report: drawn, listed, decided on, as range, azimuth and elevation are."""

from __future__ import annotations

import html
import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from ftproc import pipeline
from ftproc.files import decisions
from ftproc.records import ACCEPTED, ENDS, PATCH, REJECTED, Line, Trajectory
from ftproc.report.page import FIGURES, page
from ftproc.report.patches import patches
from ftproc.report.view import view
from ftproc.settings import FilterSettings
from ftproc.simulation import simulate

SCENARIOS = {"radar-doppler": ("range_rate", "Ṙ, m/s", 6), "surveillance-2d": ("height", "h, m", 6)}


@cache
def made(scenario: str, smooth: bool = True) -> Trajectory:
    """With a patch in the channel, and four lines of decisions on it."""
    log = simulate(scenario, seed=1).log
    if log.heights is None:
        assert log.range_rate is not None
        rate = log.range_rate.copy()
        rate[60:66] += 40.0
        log = replace(log, range_rate=rate)
    else:
        above = log.heights.above_m.copy()
        above[60:66] += 900.0
        log = replace(log, heights=log.heights._replace(above_m=above))
    channel = SCENARIOS[scenario][0]
    lines = [
        Line(2, channel, ENDS[1], 100, 119, "bad", reason="=an echo"),
        Line(3, channel, ENDS[0], *log.time_s[[130, 131]].tolist(), "good"),
    ]
    log = decisions.Decisions("d.csv", "0", tuple(lines)).applied(log)
    return pipeline.filter_log(log, FilterSettings(smooth=smooth))


@pytest.mark.parametrize("scenario", SCENARIOS)
@pytest.mark.parametrize("smooth", [False, True])
def test_residuals_have_the_sigmas_that_are_published(scenario: str, smooth: bool) -> None:
    found = made(scenario, smooth)
    assert found.diagnostics is not None
    channel = found.diagnostics.beside[SCENARIOS[scenario][0]]
    good = (channel.label == 0) & np.isfinite(channel.residual)
    scaled = (channel.residual / channel.residual_sigma)[good]
    assert good.mean() > 0.75
    assert 0.8 < np.sqrt(np.mean(scaled**2)) < 1.15
    off = np.abs(channel.reading - channel.cleaned)[good]
    assert np.median(off) < 2 * np.median(channel.residual_sigma[good])


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_it_is_drawn_with_the_others(scenario: str) -> None:
    name, title, count = SCENARIOS[scenario]
    shown = view(made(scenario))
    for what, word in (("readings", title), ("residuals", f"{title.partition(',')[0]}, sigmas")):
        figure = FIGURES[what](shown).figure
        assert figure is not None
        axes = [axis.title.text for axis in figure.select_yaxes()]
        assert axes[-1] == word
        uses = {(trace.meta["component"], trace.meta["use"]) for trace in figure.data if trace.meta}
        assert {(name, "bad"), (name, "good"), (name, "auto")} <= uses
    (patch,) = (each for each in patches(shown) if each.component == name and each.readings >= count)
    assert abs(patch.size) == pytest.approx(40.0 if name == "range_rate" else 900.0, rel=0.1)


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_decisions_on_it_hold_and_stand_on_the_page(scenario: str) -> None:
    """Those that were made before too, so that the file that it offers adds to them."""
    name, found = SCENARIOS[scenario][0], made(scenario)
    assert found.extra is not None
    label = np.asarray(found.extra.column(f"outlier_{name}"))
    there = np.isfinite(found.diagnostics.beside[name].reading)  # type: ignore[union-attr]
    assert (label[100:120] == REJECTED).sum() == there[100:120].sum() > 15
    assert (label[130:132][there[130:132]] == ACCEPTED).all()
    assert (label[60:66][there[60:66]] == PATCH).all()
    lines = found.metadata["decisions"]["lines"]
    assert lines[0]["readings"] == there[100:120].sum()
    assert lines[0]["inside_gate"] >= 0.8 * lines[0]["readings"], "they are good"
    text = page(found)
    assert f"<option>{name}</option>" in text
    area = re.search(r"<textarea[^>]*>(.*?)</textarea>", text, re.DOTALL)
    assert area is not None
    kept = html.unescape(area[1])
    assert kept.splitlines()[0] == "component,from_s,to_s,from_row,to_row,use,reason"
    again = list(decisions._lines("kept.csv", kept))
    assert [(line.ends, line.first, line.last, line.use) for line in again] == [
        (ends, line[ends[0]], line[ends[1]], line["use"]) for line, ends in zip(lines, reversed(ENDS), strict=True)
    ]


def test_the_command_on_the_page_is_that_of_the_run_with_the_file() -> None:
    trajectory = made("radar-doppler")
    for typed, offered in {
        "": "ftproc filter &#x27;simulated radar-doppler, seed 1&#x27; --smooth",
        "ftproc filter a.csv --jerk 3 --decisions d.csv --smooth": "ftproc filter a.csv --jerk 3 --smooth",
        "ftproc filter a.csv --decisions=d.csv --gate 3": "ftproc filter a.csv --gate 3",
    }.items():
        text = page(replace(trajectory, metadata={**trajectory.metadata, "command": typed}))
        assert f"<code>{offered} --decisions " in text
