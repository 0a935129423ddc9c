"""The page in a real browser: it draws, reports no error, reacts to the mouse, and prints."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from ftproc import pipeline, report
from ftproc.files import decisions
from ftproc.records import ISOLATED, REJECTED
from ftproc.report import index
from ftproc.report.browser import printing
from ftproc.report.index import Entry
from ftproc.report.page import _text
from tests import test_decisions
from tests.report.browser import NEEDED, Opened, browser
from tests.report.flights import filtered, flight, hostile

pytestmark = [NEEDED, pytest.mark.filterwarnings("default")]  # of playwright's own


@pytest.fixture(scope="module")
def context(tmp_path_factory):
    with browser(tmp_path_factory.mktemp("profile")) as opened:
        yield opened


@pytest.fixture(scope="module")
def show(context, tmp_path_factory):
    """show(trajectory, truth) -> the page, opened."""

    def written(trajectory, truth=None):
        file = tmp_path_factory.mktemp("page") / "page.html"
        report.write(trajectory, file, truth)
        return Opened(context, file)

    return written


@pytest.fixture(scope="module")
def usual(show):
    return show(filtered(), flight().truth)


def test_everything_is_drawn_without_an_error(usual):
    assert usual.complaints == []
    drawn = usual.page.evaluate(
        "() => Array.from(document.querySelectorAll('figure')).map(f => [f.id, f._fullData.length, f.clientWidth,"
        " f.querySelectorAll('.scatterlayer .trace, canvas').length])"
    )
    assert [name for name, *_ in drawn] == [
        "errors", "ground", "track", "readings", "worst", "residuals", "nis", "sigmas", "motion",
    ]  # fmt: skip
    assert all(traces > 0 and width > 300 and marks > 0 for _, traces, width, marks in drawn)


def test_nothing_exceeds_a_laptop_window(usual):
    wide = usual.page.evaluate("document.documentElement.scrollWidth")
    assert wide <= 1366


@pytest.mark.parametrize("name", ["readings", "residuals", "nis", "sigmas", "motion", "errors"])
def test_axis_titles_and_labels_do_not_overlap(usual, name):
    """Boxes of all texts of a figure, taken from the browser; none overlaps another or leaves the figure."""
    boxes = usual.page.evaluate(
        "id => { const place = document.getElementById(id), frame = place.getBoundingClientRect();"
        " const kinds = '.ytick text, .xtick text, .g-xtitle text, [class^=g-y] text, .legendtext';"
        " const texts = place.querySelectorAll(kinds);"
        " return Array.from(texts).filter(t => t.textContent.trim()).map(t => { const b = t.getBoundingClientRect();"
        " return [t.textContent, b.left - frame.left, b.top - frame.top, b.right - frame.left, b.bottom - frame.top,"
        " frame.width, frame.height]; }); }",
        name,
    )
    assert len(boxes) > 5
    for text, left, top, right, bottom, width, height in boxes:
        assert left >= -1, text
        assert top >= -1, text
        assert right <= width + 1, text
        assert bottom <= height + 1, text
    for i, (text, left, top, right, bottom, *_) in enumerate(boxes):
        for other, a, b, c, d, *_ in boxes[i + 1 :]:
            assert min(right, c) - max(left, a) < 1 or min(bottom, d) - max(top, b) < 1, f"{text!r} overlaps {other!r}"


def test_hover_shows_values_and_the_legend_hides_traces(usual):
    page = usual.page
    page.locator("#motion").scroll_into_view_if_needed()
    page.locator("#motion .nsewdrag").first.hover()
    page.wait_for_selector("#motion .hoverlayer .hovertext", timeout=5000)
    seen = "t => t.name === 'good reading' && t.visible === true"
    count = f"() => document.getElementById('readings')._fullData.filter({seen}).length"
    assert page.evaluate(count) == 3
    page.locator("#readings .legendtoggle").first.click()
    page.wait_for_function(f"() => ({count})() === 0", timeout=5000)


def test_hostile_names_do_nothing(show):
    opened = show(hostile())
    assert opened.complaints == []
    assert opened.page.locator("figure .main-svg, figure canvas").count() > 0


def test_crowded_marks_are_thinned_and_all_appear_on_zooming_in(context, tmp_path, monkeypatch):
    """The page holds all marks; few are drawn, without WebGL, with the same extremes."""
    monkeypatch.setattr("ftproc.report.drawing.MANY_MARKS", 10)
    monkeypatch.setattr("ftproc.report.page._text", lambda file: _text(file).replace("COLUMNS = 400", "COLUMNS = 4"))
    made = filtered()
    report.write(made, tmp_path / "page.html")
    opened = Opened(context, tmp_path / "page.html")
    assert opened.complaints == []
    marks = (
        "() => document.getElementById('readings')._fullData.filter(t => t.mode === 'markers' && t.xaxis === 'x' &&"
        " t.name === 'isolated outlier').map(t => [t.type, Array.from(t.x), Array.from(t.y)])"
    )
    times = made.time_s[made.outlier[:, 0] == ISOLATED]
    ((kind, x, y),) = opened.page.evaluate(marks)
    figure = report.plot(made, "readings")
    every = next(trace for trace in figure.data if trace.name == "isolated outlier")
    assert kind == "scatter"
    assert 4 <= len(x) <= 8 < len(times)
    assert (min(y), max(y)) == (min(every.y), max(every.y))
    low, high = times[3] - 0.01, times[6] + 0.01
    opened.page.evaluate(f"() => Plotly.relayout('readings', {{'xaxis2.range': [{low}, {high}]}})")
    opened.page.wait_for_function(f"() => ({marks})()[0][1].length === 4", timeout=5000)
    np.testing.assert_array_equal(opened.page.evaluate(marks)[0][1], times[3:7])
    opened.page.evaluate("() => Plotly.relayout('readings', {'xaxis.range': [0, 40]})")
    opened.page.wait_for_function(f"() => ({marks})()[0][1].length === {len(x)}", timeout=5000)


def test_printing_at_load_prints_all_figures(context, tmp_path):
    """The load event comes when all is drawn, so a printer that waits for it has all figures."""
    report.write(filtered(), tmp_path / "page.html")
    page = context.new_page()
    page.goto((tmp_path / "page.html").as_uri(), wait_until="load")
    assert page.locator("figure .main-svg").count() >= 7
    assert page.evaluate("document.body.dataset.drawn") == "yes"


def test_unescaped_scripts_do_not_run(context, tmp_path, monkeypatch):
    """Even if a name were not escaped, the page's policy keeps it from running."""
    monkeypatch.setattr("ftproc.report.tables.html.escape", lambda text: text)
    made = replace(
        filtered(), metadata={**filtered().metadata, "log": "<script>alert(1)</script><img src=x onerror=alert(2)>"}
    )
    report.write(made, tmp_path / "page.html")
    opened = Opened(context, tmp_path / "page.html")
    assert not any(re.fullmatch(r"\d", complaint) for complaint in opened.complaints)  # no dialog
    assert any("Content Security Policy" in complaint for complaint in opened.complaints)


def test_printing_fits_the_paper_and_restores_the_window(usual):
    page = usual.page
    eye = "() => document.getElementById('track')._fullLayout.scene.camera.eye"
    near = page.evaluate(eye)
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    page.wait_for_function("() => document.getElementById('readings')._fullLayout.width === 680", timeout=5000)
    assert page.evaluate("() => document.getElementById('ground')._fullLayout.width") == 340
    assert page.evaluate(eye)["x"] < 1.1 * near["x"] < 0  # more distant, so that no label is cut
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    page.wait_for_function("() => document.getElementById('readings')._fullLayout.width > 1000", timeout=5000)
    assert page.evaluate(eye) == pytest.approx(near)
    paper = page.pdf(format="A4", prefer_css_page_size=True)
    pages = paper.count(b"/Type /Page\n") or len(re.findall(rb"/Type\s*/Page\b", paper))
    assert 3 <= pages <= 9


def test_the_link_of_a_patch_zooms_all_figures_over_time(usual):
    page = usual.page
    ranges = (
        "() => ['readings', 'residuals', 'nis', 'sigmas', 'motion', 'errors'].map(name =>"
        " document.getElementById(name)._fullLayout.xaxis.range.map(Number))"
    )
    whole = page.evaluate(ranges)
    link = page.locator("button[data-from]").first
    start, end = (float(link.get_attribute(name)) for name in ("data-from", "data-to"))
    link.click()
    page.wait_for_function(f"() => ({ranges})().every(r => r[0] < {start} && r[1] > {end} && r[1] - r[0] < 20)")
    page.locator("button[data-from='']").click()
    page.wait_for_function(f"() => JSON.stringify(({ranges})()) === JSON.stringify({whole})")


def test_a_page_for_paper_is_drawn_for_it_at_once(context, tmp_path):
    """In the widths of A4 before anyone prints; the track in space as a picture."""
    report.write(filtered(), tmp_path / "window.html", flight().truth)
    (tmp_path / "page.html").write_bytes(printing.on_paper((tmp_path / "window.html").read_bytes()))
    opened = Opened(context, tmp_path / "page.html")
    assert opened.complaints == []
    sizes = opened.page.evaluate(
        "() => Object.fromEntries(Array.from(document.querySelectorAll('figure')).map(f => [f.id, f._fullLayout ?"
        " [f._fullLayout.width, f._fullLayout.height] : [f.querySelector('img').naturalWidth, 0]]))"
    )
    assert sizes.pop("track")[0] > 1000
    assert {name: width for name, (width, _) in sizes.items()} == {
        **dict.fromkeys(("errors", "readings", "worst", "residuals", "nis", "sigmas", "motion"), 680), "ground": 340,
    }  # fmt: skip
    assert all(100 < height <= 900 for _, height in sizes.values())
    before = opened.page.evaluate("() => document.getElementById('readings')._fullLayout.height")
    opened.page.evaluate("dispatchEvent(new Event('afterprint'))")
    assert opened.page.evaluate("() => document.getElementById('readings')._fullLayout.height") == before
    opened.page.emulate_media(media="print")
    seen = "() => Array.from(document.querySelectorAll('.modebar, .click')).filter(e => e.offsetParent).length"
    assert opened.page.evaluate(seen) == 0
    opened.page.close()


def test_no_legend_lies_on_a_plot_in_any_width_and_nothing_exceeds_a_telephone(show):
    """In a laptop's window, on paper, and on a telephone, which shows the summary whole."""
    page = show(filtered(), flight().truth).page
    width = "() => document.getElementById('readings')._fullLayout.width"
    legends_are_free(page)
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    page.wait_for_function(f"{width} === 680", timeout=5000)
    legends_are_free(page)
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    page.wait_for_function(f"{width} > 1000", timeout=5000)
    page.set_viewport_size({"width": 390, "height": 844})
    page.wait_for_function(f"{width} < 390", timeout=5000)
    page.wait_for_function("() => document.documentElement.scrollWidth <= 390", timeout=5000)
    legends_are_free(page)
    inside = page.evaluate(
        "() => Array.from(document.querySelectorAll('table.whole th, table.whole td'))"
        ".every(cell => cell.getBoundingClientRect().right <= 390)"
    )
    assert inside
    assert page.evaluate("document.documentElement.scrollWidth") == 390
    page.close()


def legends_are_free(page):
    """None of them lies on the plot of its figure."""
    page.wait_for_timeout(500)
    found = page.evaluate(
        "() => Array.from(document.querySelectorAll('figure')).filter(f => f.querySelector('.legendtext')"
        " && f.querySelector('.nsewdrag')).map(f => [f.id,"
        " Math.max(...Array.from(f.querySelectorAll('.legendtext'), t => t.getBoundingClientRect().bottom)),"
        " Math.min(...Array.from(f.querySelectorAll('.nsewdrag'), d => d.getBoundingClientRect().top))])"
    )
    assert len(found) > 4
    for name, bottom, top in found:
        assert bottom <= top + 2, name


def test_clicks_write_decisions_and_the_page_keeps_them(show, tmp_path):
    opened = show(filtered())
    page = opened.page
    first = page.locator("button.decide[data-use=bad]").first
    patch = {name: first.get_attribute(f"data-{name}") for name in ("component", "start", "end")}
    first.click()
    written = page.locator("#decisions")
    line = f"{patch['component']},{patch['start']},{patch['end']},bad,"
    assert written.input_value().splitlines() == ["component,from_s,to_s,use,reason", line]
    assert first.get_attribute("aria-pressed") == "true"
    page.locator("button.decide[data-use=good]").first.click()  # of the same patch: instead of the other
    assert written.input_value().splitlines()[1:] == [line.replace("bad", "good")]
    page.locator("button.decide[data-use=good]").first.click()
    assert written.input_value().splitlines()[1:] == []
    place = page.evaluate(
        "() => { const figure = document.getElementById('worst'); figure.scrollIntoView();"
        " const trace = figure._fullData.findIndex(t => t.name.startsWith('isolated'));"
        " const point = figure.calcdata[trace][0], box = figure.getBoundingClientRect(), layout = figure._fullLayout;"
        " const axes = figure._fullData[trace], x = layout[axes.xaxis.replace('x', 'xaxis')],"
        " y = layout[axes.yaxis.replace('y', 'yaxis')];"
        " return [box.left + x._offset + x.c2p(point.x), box.top + y._offset + y.c2p(point.y), point.x,"
        " axes.meta.component]; }"
    )
    page.mouse.move(place[0], place[1])
    page.wait_for_selector("#worst .hoverlayer .hovertext", timeout=5000)
    page.mouse.click(place[0], place[1])
    page.wait_for_function("() => document.getElementById('decisions').value.split('\\n').length > 2", timeout=5000)
    component, start, end, use, _ = written.input_value().splitlines()[1].split(",")
    assert (component, float(start), float(end), use) == (place[3], place[2], place[2], "good")
    assert float(start) in filtered().time_s  # to the last digit
    page.locator("#component").select_option("all")
    page.locator("#stretch").click()
    assert written.input_value().splitlines()[2].startswith("all,")
    with page.expect_download() as kept:
        page.locator("#keep").click()
    kept.value.save_as(tmp_path / "kept.csv")
    assert (tmp_path / "kept.csv").read_text() == written.input_value()
    assert opened.complaints == []


def test_the_file_that_the_page_keeps_frees_a_flight_with_a_fifth_of_outliers(show, tmp_path):
    """Three stretches, each shown and named; the result is that of the same lines by hand."""
    flight = test_decisions.followed(3)
    lost = pipeline.filter_log(flight.log, test_decisions.SMOOTH)
    assert test_decisions.verdict(lost) == "suspect"
    page, stretches = show(lost).page, test_decisions.patches(flight)
    page.locator("#component").select_option("all")
    for _, low, high, _ in stretches:
        shown = (flight.log.time_s[[low, high]] + [-0.05, 0.05]).tolist()
        page.evaluate("range => Plotly.relayout('readings', {'xaxis.range': range})", shown)
        page.locator("#stretch").click()
    with page.expect_download() as kept:
        page.locator("#keep").click()
    kept.value.save_as(tmp_path / "kept.csv")
    assert len((tmp_path / "kept.csv").read_text().splitlines()) == 1 + len(stretches) == 4
    same = test_decisions.by_hand(flight.log, *stretches)
    freed, typed = (
        pipeline.filter_log(log, test_decisions.SMOOTH)
        for log in (decisions.read(tmp_path / "kept.csv").applied(flight.log), same)
    )
    np.testing.assert_array_equal(freed.state, typed.state)
    assert test_decisions.verdict(freed) == "consistent"
    blanked = np.where(same.by_hand.flags == REJECTED, np.nan, flight.log.measurement)
    best = pipeline.filter_log(replace(flight.log, measurement=blanked), test_decisions.SMOOTH)
    assert test_decisions.error_m(freed, flight) < 1.1 * test_decisions.error_m(best, flight)


def test_axes_of_time_say_the_clock_and_seconds_since_the_start(show, usual):
    made = filtered()
    known = show(replace(made, metadata={**made.metadata, "epoch": "2024-05-25T12:00:00Z"}))
    texts = "document.querySelectorAll('#motion [class^=x][class$=tick] text')"
    ticks = f"() => Array.from({texts}).map(each => each.textContent)"
    labels = known.page.evaluate(ticks)
    assert "12:00:10T+10" in labels
    known.page.evaluate("Plotly.relayout('motion', {'xaxis.range': [10.0, 12.0]})")
    known.page.wait_for_function(f"() => ({ticks})().includes('12:00:10.2T+10.2')", timeout=5000)
    assert sorted(map(float, usual.page.evaluate(ticks)))[:3] == [0, 5, 10]  # the times themselves


def test_the_index_sorts_and_filters(context, tmp_path):
    summary = {"method": "ukf", **filtered().metadata["summary"]}
    entries = [Entry(f"{rows}.csv", None, {**summary, "rows": rows}) for rows in (900, 12_000, 61)]
    index.write([*entries, Entry("none.csv", None, {}, "none.csv: there is no such file.")], tmp_path / "index.html")
    opened = Opened(context, tmp_path / "index.html")
    page, logs = opened.page, "td:first-child:visible"
    assert page.locator(logs).all_inner_texts() == ["none.csv", "900.csv", "12000.csv", "61.csv"]
    page.get_by_role("button", name="rows").click()
    assert page.locator(logs).all_inner_texts() == ["61.csv", "900.csv", "12000.csv", "none.csv"]
    page.get_by_role("button", name="rows").click()
    assert page.locator(logs).all_inner_texts() == ["12000.csv", "900.csv", "61.csv", "none.csv"]
    page.get_by_label("failed").uncheck()
    page.get_by_label("Show only rows with").fill("0.csv UKF")
    assert page.locator(logs).all_inner_texts() == ["12000.csv", "900.csv"]
    assert "2 of 4 shown" in page.locator(".filter").inner_text()
    assert opened.complaints == []
    page.close()
