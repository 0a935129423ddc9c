"""The page that lists the reports."""

from __future__ import annotations

from ftproc.report import index
from ftproc.report.index import Entry
from tests.report.flights import HOSTILE, filtered, one_row

SUMMARY = {"method": "ukf", **filtered().metadata["summary"]}


def written(tmp_path, *entries):
    index.write(entries, tmp_path / "index.html")
    return (tmp_path / "index.html").read_text()


def made(tmp_path, *names):
    for name in names:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    return [str(tmp_path / name) for name in names]


def test_a_line_for_each_log_the_worst_first(tmp_path):
    page, log, output = made(tmp_path, "a b#1.report.html", "in/a.csv", "out/a.csv")
    text = written(
        tmp_path,
        Entry(log, page, SUMMARY, None, output),
        Entry("c.csv", None, one_row().metadata["summary"]),
        Entry("d.csv", None, {}, "d.csv: there is no such file."),
        Entry("e.csv", None, {}),
    )
    assert "<h1>4 logs: 1 consistent, 1 suspect, 1 unknown, 1 failed</h1>" in text
    assert f'<a href="./a%20b%231.report.html">{log}</a>' in text
    assert '<a href="./in/a.csv">log</a> <a href="./out/a.csv">trajectory</a>' in text
    assert "too few good range readings (1) to test the sigmas; " in text
    assert "d.csv: there is no such file." in text
    found = [text.index(f">{level}</span>") for level in ("failed", "suspect", "consistent", "unknown")]
    assert found == sorted(found)


def test_no_link_to_what_is_not_there(tmp_path):
    """Nor to what an earlier run has left of a log that fails now."""
    page, output = made(tmp_path, "a.report.html", "a.trajectory.csv")
    text = written(
        tmp_path,
        Entry("a.csv", page, {}, "a.csv: broken", output),
        Entry("b.csv", str(tmp_path / "b.report.html"), SUMMARY, None, str(tmp_path / "b.trajectory.csv")),
        Entry("-", None, SUMMARY, None, "s3://bucket/c.csv"),
    )
    assert "<a " not in text


def test_names_do_not_run(tmp_path):
    hostile = made(tmp_path, f"{HOSTILE.replace('/', '')}.html", 'javascript:"onclick=alert(1).html')
    text = written(tmp_path, Entry(HOSTILE, hostile[0], {"method": HOSTILE, **SUMMARY}, None),
                   Entry(HOSTILE, None, {}, HOSTILE), Entry("x", hostile[1], {}))  # fmt: skip
    assert text.count("<script") == 1  # its own
    assert '"onclick' not in text
    assert 'href="./javascript%3A' in text
