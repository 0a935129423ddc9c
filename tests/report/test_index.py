"""The page that lists the reports."""

from __future__ import annotations

from ftproc.report import index
from ftproc.report.index import Entry
from tests.report.flights import HOSTILE, filtered, one_row

SUMMARY = {"method": "ukf", **filtered().metadata["summary"]}


def written(tmp_path, *entries):
    index.write(entries, tmp_path / "index.html")
    return (tmp_path / "index.html").read_text()


def test_a_line_for_each_log(tmp_path):
    text = written(
        tmp_path,
        Entry("in/a.csv", "out/a b#1.report.html", SUMMARY),
        Entry("c.csv", "out/c.report.html", one_row().metadata["summary"]),
        Entry("d.csv", None, {}, "d.csv: there is no such file."),
        Entry("e.csv", "out/e.report.html", {}),
    )
    assert "<h1>3 reports, 1 failed</h1>" in text
    assert '<a href="./a%20b%231.report.html">in/a.csv</a>' in text
    assert ">consistent</span></td><td>" in text
    assert ">suspect</span>" in text
    assert "too few good range readings (1) to test the sigmas; " in text
    assert ">failed</span>" in text
    assert "d.csv: there is no such file." in text
    assert ">unknown</span>" in text
    assert text.count("<a ") == 3


def test_names_do_not_run(tmp_path):
    text = written(tmp_path, Entry(HOSTILE, f"out/{HOSTILE}.html", {"method": HOSTILE, **SUMMARY}, None),
                   Entry(HOSTILE, None, {}, HOSTILE), Entry("x", 'javascript:"onclick=alert(1).html', {}))  # fmt: skip
    assert "<script" not in text
    assert '"onclick' not in text
    assert 'href="./javascript%3A' in text
