"""The page as text: what is in it, and that nothing in a file can run."""

from __future__ import annotations

import base64
import gzip
import hashlib
import html
import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest

from ftproc import report
from ftproc.derived.extremes import extremes
from ftproc.report.page import _WRAPPER, _figure, document, page
from ftproc.report.patches import patches
from ftproc.report.view import view
from tests.report.flights import HOSTILE, angles_only, filtered, flight, hostile, one_row, position_only


class Elements(HTMLParser):
    """Every element with its attributes, and the text by element."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found, self.text, self.inside = [], {}, []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.found.append((tag, dict(attributes)))
        self.inside.append(tag)

    def handle_endtag(self, tag):
        if tag in self.inside:
            while self.inside.pop() != tag:
                pass

    def handle_data(self, data):
        if self.inside:
            self.text.setdefault(self.inside[-1], []).append(data)


def scripts(text):
    """Scripts that run: the library, once unpacked, and the page's own."""
    packed = re.findall(r'<script type="application/gzip" id="library">(.*?)</script>', text)
    unpacked = [gzip.decompress(base64.b64decode(part)).decode() for part in packed]
    return unpacked + re.findall(r"<script>(.*?)</script>", text, re.DOTALL)


@pytest.fixture(scope="module")
def text():
    return page(filtered())


def test_plotly_is_read_once_without_its_wrapper():
    """As plotly 6.0 to 7.1 wrap it; what is wrapped otherwise stays as it is."""
    before = "/** licence */\n(\n function(root, factory) {\n root.x = factory();\n}\n} (this, () => {\n"
    after = "\nwindow.Plotly = Plotly;\nreturn Plotly;\n}));"
    script = '"use strict";var Plotly=(()=>{return 1})();\n'
    assert _WRAPPER.sub(lambda found: found[1], before + script + after) == "/** licence */\n" + script
    assert _WRAPPER.sub(lambda found: found[1], script + after) == script + after


def test_one_plotly_and_no_other_address(text):
    library, own = scripts(text)
    assert "plotly.js v" in library[:200]
    without = re.sub(r"<script( type=.application/gzip.*?)?>.*?</script>", "", text, flags=re.DOTALL)
    assert not re.search(r"(src|href)=|https?:|url\(|@import", without + own)
    assert len(without) < 2_000_000


def test_only_the_two_own_scripts_may_run(text):
    (policy,) = re.findall(r'http-equiv="Content-Security-Policy" content="([^"]*)"', text)
    digests = {base64.b64encode(hashlib.sha256(s.encode()).digest()).decode() for s in scripts(text)}
    assert set(re.findall(r"'sha256-([^']*)'", policy)) == digests
    assert policy.startswith("default-src 'none'; ")
    assert "'unsafe-inline'" not in policy.split("script-src")[1].split(";")[0]


@pytest.mark.parametrize("truth", [False, True])
def test_nothing_from_a_file_becomes_an_element(truth):
    known = replace(flight().truth, name=HOSTILE) if truth else None
    made, plain = Elements(page(hostile(), known)), Elements(page(filtered(), flight().truth if truth else None))
    extra = [tag for tag, _ in made.found if tag not in ("tr", "th", "td")]
    assert extra == [tag for tag, _ in plain.found if tag not in ("tr", "th", "td")]
    assert not any(name.startswith("on") for _, attributes in made.found for name in attributes)
    assert made.text["h1"] == ["script>.csv"]  # the name's last part, as text
    assert HOSTILE in made.text["td"]


def test_a_figure_cannot_end_its_element():
    """Whatever the library leaves in its JSON."""
    words = "</script><!-- & \u2028 > \\u003c"
    figure = SimpleNamespace(to_json=lambda: json.dumps({"x": words}, ensure_ascii=False), layout=Mock(height=50))
    found = _figure("x", figure)
    inside = re.search(r"<script[^>]*>(.*)</script>", found, re.DOTALL)
    assert inside is not None
    assert not set(inside[1]) & set("<>&\u2028")
    assert json.loads(inside[1]) == {"x": words}


def figures(text):
    found = re.findall(r'data-figure="(\w+)">(.*?)</script>', text, re.DOTALL)
    return {name: json.loads(content) for name, content in found}


def test_figures_are_json_and_have_their_places(text):
    found = figures(text)
    assert list(found) == ["ground", "track", "readings", "worst", "residuals", "nis", "sigmas", "motion"]
    places = [attributes["id"] for tag, attributes in Elements(text).found if tag == "figure"]
    assert places == list(found)
    x = found["motion"]["data"][0]["x"]
    times = np.frombuffer(base64.b64decode(x["bdata"]), x["dtype"])
    np.testing.assert_array_equal(times[np.isfinite(times)], filtered().time_s)


def test_words_of_the_page(text):
    assert "<h1>simulated manoeuvre, seed 3</h1>" in text
    assert f"{len(filtered()):,} rows · 40 s · filtered by ga-bpnn-ukf, two-pass editing" in text
    assert "<strong>consistent: residuals agree with the published sigmas" in text
    parts = filtered().metadata["summary"]["components"].values()
    for name in ("good", "isolated", "patch"):
        assert f"<td>{name}</td>{''.join(f'<td>{part[name]}</td>' for part in parts)}" in text
    assert re.search(r"<th>jerk_profile</th><td>psd_m2ps5 \d+ values, from", text)
    assert "<th>version</th><td>" in text
    assert "<th>station</th><td>azimuth_zero_rad 0, elevation_from horizon, bias 0, 0, 0," in text
    assert "No network correction: " in text
    assert "Against the truth" not in text


def test_the_head_says_when_where_and_of_what(text):
    settings = {**filtered().metadata["settings"], "site": [48.0812, -11.2803, 612.0]}
    more = {"epoch": "2024-05-25T12:00:00Z", "settings": settings, "understood": {"target": "track=7", "columns": {}}}
    more["station"] = {"in_words": ["bias 2.5 m of the range taken out"]}
    found = page(replace(filtered(), metadata={**filtered().metadata, **more}))
    assert "T+0 is 2024-05-25 12:00:00.00 UTC · station 48.08120° N, 11.28030° W, 612 m · target track=7" in found
    assert "instrument: bias 2.5 m of the range taken out" in found
    assert "T+0 is" not in text  # counts from zero, and no date is known


def test_extremes_are_buttons_with_their_times(text):
    greatest = next(each for each in extremes(filtered()) if each.what == "greatest speed")
    button = rf'<button data-from="[^"]+" data-to="[^"]+">greatest speed</button></td><td>{greatest.value:,.1f}'
    assert re.search(button, text)
    assert f"<td>{greatest.time_s:,.2f}</td>" in text


def test_what_is_long_is_folded(text):
    titles = re.findall(r"<details><summary><h2>(.*?)</h2>", text)
    assert titles == ["Settings, noise and process noise as used; provenance"]
    columns = {"range": {"column": "RNG<b>", "unit": "km", "unit_from": "assumed", "why": "its name"}}
    understood = {"file": "text", "columns": columns, "not_used": ["Q"], "clock": "seconds", "epoch": ""}
    found = page(replace(filtered(), metadata={**filtered().metadata, "understood": understood}))
    assert "<td>range</td><td>RNG&lt;b&gt;</td><td>km</td><td>assumed</td><td>its name</td>" in found


def test_rival_understandings_are_listed_where_there_are_some(text):
    assert "nearly as likely" not in text
    rivals = [{"what": "a step of the azimuth at 12 s", "nats": 1.5}, {"what": "a manoeuvre", "nats": 2.5}]
    summary = {**filtered().metadata["summary"], "rivals": rivals}
    found = page(replace(filtered(), metadata={**filtered().metadata, "summary": summary}))
    assert "<th>what</th><th>nats</th>" in found
    assert "<td>a manoeuvre</td><td>2.5</td>" in found


def test_decisions_name_the_log_and_every_patch_has_its_buttons(text):
    found = patches(view(filtered()))
    assert len(found) > 1
    for patch in found:
        ends = f'data-start="{patch.start_s!r}" data-end="{patch.end_s!r}"'
        assert text.count(f'<button class="decide" data-component="{patch.component}" {ends} data-use="good">') == 1
    assert "ftproc filter 'simulated manoeuvre, seed 3' --decisions" in html.unescape(text)
    readings = figures(text)["readings"]["data"]
    meant = {(trace["name"], trace["meta"]["use"]) for trace in readings if "meta" in trace}
    assert meant == {("good reading", "bad"), ("isolated outlier", "good"), ("patch outlier", "good")}


def test_several_reasons_are_a_list():
    assert "<strong>suspect:</strong><ul><li>too few good range readings (1)" in page(one_row())
    assert 'style="border-color: #E69F00"' in page(one_row())


def test_page_without_position_says_so():
    text = page(angles_only())
    assert list(figures(text)) == ["readings", "worst", "residuals", "nis", "sigmas"]
    assert "There is no position to draw" in text
    assert "range missing throughout: position and velocity are not observable" in text


def test_page_of_a_file_of_another_program_with_truth():
    text = page(position_only(), flight().truth)
    assert "no verdict: this file does not say how it was made" in text
    assert "Summary</h2>" not in text
    assert "Against the truth" in text
    assert "position RMSE (m)" in text
    assert "errors" in figures(text)


def test_a_verdict_of_another_version_is_not_shown():
    metadata = {**filtered().metadata, "summary": {"trust": {"verdict": "fine", "reasons": []}, "rows": 3}}
    assert "no verdict: " in page(replace(filtered(), metadata=metadata))


def test_same_trajectory_same_bytes(tmp_path):
    for name in ("one.html", "two.html"):
        report.write(filtered(True), tmp_path / name, flight().truth)
    assert (tmp_path / "one.html").read_bytes() == (tmp_path / "two.html").read_bytes()
    assert (tmp_path / "one.html").stat().st_size < 3_000_000


def test_document_without_figures_runs_nothing():
    text = document("A & B", "<p>x</p>")
    assert "script-src 'none'" in text
    assert "<title>A &amp; B</title>" in text
    assert scripts(text) == []


def test_decisions_by_hand_are_marked_and_a_click_takes_them_back():
    flags = filtered().outlier.copy()
    flags[50:55, 0], flags[60, 1] = 4, 5
    made = replace(filtered(), outlier=flags)
    for name in ("readings", "residuals"):
        marked = {trace["name"]: trace for trace in figures(page(made))[name]["data"] if "by hand" in trace["name"]}
        assert {each: trace["meta"]["use"] for each, trace in marked.items()} == {
            "rejected by hand": "auto", "accepted by hand": "auto",
        }  # fmt: skip
    used = view(made).components_used - view(filtered()).components_used
    assert used[52] in (-1, 0)
    assert used[60] in (0, 1)
