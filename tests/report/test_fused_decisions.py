"""Decisions on the readings of several stations, written by clicks on the page of a fused flight."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ftproc.files import decisions
from ftproc.files.writing import ranges
from ftproc.fusion import flight, range_file
from ftproc.fusion.flight import Flight
from ftproc.records import MISSING
from ftproc.report import fused
from ftproc.report.fused.figures import log_clocks, residuals
from ftproc.settings import FilterSettings
from ftproc.simulation import simulate_range
from tests.report.browser import NEEDED, Opened, browser


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Flight:
    """A radar and two theodolites, whose clocks are off."""
    folder = tmp_path_factory.mktemp("range")
    ranges.write(simulate_range("range-radar", 7, 20.0), str(folder), str(folder / "truth.parquet"))
    return flight.fuse(range_file.load(str(folder / "range.toml")), FilterSettings())


def test_times_of_the_page_are_those_of_the_logs_with_their_clocks(made: Flight) -> None:
    assert made.fused is not None
    clocks = log_clocks(made, made.fused)
    assert max(map(abs, clocks.values())) > 0.005
    figure = residuals(made, made.fused).figure
    assert figure is not None
    traces = [trace for trace in figure.data if trace.meta]
    assert {trace.meta["station"] for trace in traces} == set(made.edited)
    for trace in traces:
        times = np.asarray(made.edited[trace.meta["station"]].column("time_s"))
        own = np.asarray(trace.x, float)[np.isfinite(np.asarray(trace.y, float))] + trace.meta["clock"]
        assert np.abs(own[:, None] - times).min(1).max() < 1e-6


@NEEDED
@pytest.mark.filterwarnings("default")  # of playwright's own
def test_a_click_names_the_reading_of_its_station(made: Flight, tmp_path: Path) -> None:
    fused.write(made, tmp_path / "page.html")
    with browser(tmp_path / "profile") as context:
        opened = Opened(context, tmp_path / "page.html")
        page: Any = opened.page
        written = page.locator("#decisions")
        x, y, meta = page.evaluate(
            "() => { const figure = document.getElementById('residuals'); figure.scrollIntoView();"
            " const name = figure.calcdata.findIndex(c => c[0].trace.name === 'rejected'"
            " && c[0].trace.meta.station === 'theodolite2'), trace = figure._fullData[name];"
            " const point = figure.calcdata[name][0], box = figure.getBoundingClientRect(), all = figure._fullLayout;"
            " const across = all[trace.xaxis.replace('x', 'xaxis')], up = all[trace.yaxis.replace('y', 'yaxis')];"
            " return [box.left + across._offset + across.c2p(point.x), box.top + up._offset + up.c2p(point.y),"
            " trace.meta]; }"
        )
        page.mouse.wheel(0, y - 300)
        page.wait_for_timeout(300)
        page.mouse.move(x, 300)
        page.wait_for_selector("#residuals .hoverlayer .hovertext", timeout=5000)
        page.mouse.click(x, 300)
        page.wait_for_function("() => document.getElementById('decisions').value.split('\\n').length > 2", timeout=5000)
        page.locator("#station").select_option("theodolite3")
        page.locator("#stretch").click()
        path = tmp_path / "kept.csv"
        path.write_text(written.input_value())
        assert opened.complaints == []
    first, second = list(csv.DictReader(path.read_text().splitlines()))
    assert (first["component"], first["use"], first["station"]) == (meta["component"], "good", "theodolite2")
    table = made.edited["theodolite2"]
    named = np.asarray(table.column("time_s"))
    inside = (named >= float(first["from_s"])) & (named <= float(first["to_s"]))
    label = np.asarray(table.column(f"outlier_{meta['component']}"))
    assert inside.sum() == 1
    assert label[inside][0] not in (0, MISSING)
    assert second["station"] == "theodolite3"
    assert len(decisions.read(path).lines) == 2
