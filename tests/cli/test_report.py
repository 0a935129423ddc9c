"""`--report` of filter and score: the places of the pages, refusals, the index."""

from __future__ import annotations

import json
import shutil
import sys

import pytest

from ftproc.batch import plan
from ftproc.errors import OutputError, UsageError
from ftproc.files.writing import outputs


@pytest.fixture
def clean(run, flight):
    """`clean.parquet`, the filtered flight."""
    assert run("filter", flight, "-o", "clean.parquet", "--summary", "none").code == 0
    return flight.with_name("clean.parquet")


def test_page_of_a_log(run, flight):
    result = run("filter", flight, "--report", "page.html")
    assert (result.code, result.err) == (0, "")
    assert result.out.endswith("\n  -> flight.trajectory.csv\n  -> page.html\n")
    text = (flight.parent / "page.html").read_text()
    assert "<h1>flight.csv</h1>" in text
    assert 'data-figure="residuals"' in text
    assert not (flight.parent / "index.html").exists()


def test_report_is_named_in_json_and_changes_nothing_else(run, flight):
    plain = json.loads(run("filter", flight, "--summary", "json").out)
    with_page = json.loads(run("filter", flight, "--summary", "json", "--report", "page.html").out)
    assert with_page.pop("report") == "page.html"
    assert with_page == plain
    piped = run("filter", "-", "--report", "other.html", stdin=flight.read_text())
    assert piped.out == (flight.parent / "flight.trajectory.csv").read_text()
    assert piped.err.endswith("\n  -> other.html\n")


def test_pages_of_several_logs_and_their_index(run, flight):
    shutil.copy(flight, "second.csv")
    result = run("filter", flight, "none.csv", "second.csv", "-o", "out", "--report", "pages")
    assert result.code == 1
    assert sorted(p.name for p in (flight.parent / "pages").iterdir()) == [
        "flight.report.html", "index.html", "second.report.html",
    ]  # fmt: skip
    index = (flight.parent / "pages" / "index.html").read_text()
    assert '<a href="./flight.report.html">' in index
    assert '<a href="./second.report.html">second.csv</a>' in index
    assert "none.csv: there is no such file." in index


def test_pages_of_any_number_of_workers(run, flight):
    shutil.copy(flight, "second.csv")
    for jobs, place in ((1, "one/"), (2, "two/")):
        arguments = ["-o", place, "--report", place, "--jobs", jobs, "--summary", "none"]
        assert run("filter", flight, "second.csv", *arguments).code == 0
    one, two = flight.parent / "one", flight.parent / "two"
    assert len(list(one.iterdir())) == 7  # two trajectories, sidecars and pages, and an index
    for file in one.iterdir():
        assert file.read_bytes() == (two / file.name).read_bytes()


def test_score_shows_errors_and_keeps_its_table(run, clean):
    plain = run("score", clean, "--truth", "flight.truth.csv")
    result = run("score", clean, "--truth", "flight.truth.csv", "--report", "errors.html")
    assert result == plain
    text = (clean.parent / "errors.html").read_text()
    assert 'data-figure="errors"' in text
    assert "Trajectory files and streams do not keep the raw readings" in text
    assert "compared with flight.truth.csv" in text


def test_score_of_several(run, clean, flight):
    result = run("score", clean, "none.parquet", "flight.truth.csv", "--report", "pages/")
    assert result.code == 1
    index = (clean.parent / "pages" / "index.html").read_text()
    assert '<a href="./clean.report.html">' in index
    assert "none.parquet: there is no such file" in index
    assert ">unknown</span>" in index


@pytest.mark.parametrize(
    ("names", "given", "expected"),
    [
        (["a.csv"], "r.html", (["r.html"], None)),
        (["a.csv"], "R.HTM", (["R.HTM"], None)),
        (["a.csv"], "r.pdf", (["r.pdf"], None)),
        (["d/a.trajectory.csv.gz", "d/b.parquet"], "r", (["r/a.report.html", "r/b.report.html"], "r/index.html")),
        (
            ["d/a.ukf.trajectory.csv", "d/a.ekf.trajectory.csv"],
            "r",
            (["r/a.ukf.report.html", "r/a.ekf.report.html"], "r/index.html"),
        ),
        (["-"], "v1.2/", (["v1.2/stdin.report.html"], "v1.2/index.html")),
        (["a.csv"], None, ([None], None)),
    ],
)
def test_places(here, names, given, expected):
    assert plan.pages(names, given) == expected


@pytest.mark.parametrize(
    ("names", "given", "kind", "sentence"),
    [
        (["a.csv"], "r.ps", UsageError, "--report r.ps: end the name in .html or .pdf, or in / if it is a directory."),
        (["a.csv"], "-", UsageError, "--report -: end the name in .html"),
        (["a.csv", "b.csv"], "r.pdf", UsageError, "there are several reports to write; name a directory."),
        (["x/a.csv", "y/a.csv"], "r/", UsageError, "r/a.report.html would be the page of two trajectories"),
        (["a.csv"], "none/r.html", OutputError, "there is no directory none; create it first"),
        (["a.csv"], "log.html", OutputError, "log.html: this is the input log.html, which is never overwritten. Give "
                                             "another name with --report."),
        (["a.csv"], "file/", OutputError, "this is a file, not a directory; give another name with --report."),
    ],
)  # fmt: skip
def test_refused(here, names, given, kind, sentence):
    (here / "log.html").write_text("")
    (here / "file").write_text("")
    with pytest.raises(kind) as caught:
        outputs.check(plan.pages_written(*plan.pages(names, given)), ["log.html"])
    assert sentence in str(caught.value)


def test_an_index_never_replaces_an_input(run, flight):
    """A log of any name can be an input."""
    (flight.parent / "pages").mkdir()
    model = flight.parent / "pages" / "index.html"
    model.write_text("not a model")
    result = run("filter", flight, "--model", model, "--report", "pages/")
    assert result.code == 1
    assert model.read_text() == "not a model"
    assert "which is never overwritten" in result.err


@pytest.mark.parametrize("command", ["filter", "score"])
def test_without_plotly_nothing_is_started(run, clean, monkeypatch, command):
    monkeypatch.setitem(sys.modules, "plotly.graph_objects", None)
    before = sorted(clean.parent.iterdir())
    name = "flight.csv" if command == "filter" else clean
    result = run(command, name, "--report", "pages/")
    assert result.code == 2
    assert result.out == ""
    assert result.err == 'ftproc: reports need plotly, which is not installed: pip install "plotly>=6.0".\n'
    assert sorted(clean.parent.iterdir()) == before


def test_a_page_that_cannot_be_written_leaves_the_trajectory(run, flight, monkeypatch):
    def full(*_):
        raise OutputError("page.html: the disk is full; nothing was written.")

    monkeypatch.setattr("ftproc.report.write", full)
    result = run("filter", flight, "--report", "page.html")
    assert (result.code, result.err) == (1, "ftproc: page.html: the disk is full; nothing was written.\n")
    assert (flight.parent / "flight.trajectory.csv").exists()


def test_plotly_is_only_loaded_for_a_report(shell, flight):
    script = "import sys\nfrom ftproc.cli.main import cli\nfor more in ([], ['--report', 'r.html']):\n"
    script += "    try: cli(['filter', 'flight.csv', *more])\n"
    script += "    except SystemExit: print('plotly' in sys.modules, file=sys.stderr)"
    (flight.parent / "try.py").write_text(script)
    assert shell("python try.py").err.splitlines() == ["False", "True"]
