"""`--decisions` and `--write-decisions`."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np

from ftproc.files import decisions
from ftproc.files.reading import trajectories
from ftproc.records import ISOLATED, PATCH, REJECTED


def test_what_was_taken_can_be_edited_and_given_back(run, flight):
    """The lines that were given stay as they are, and new ones follow."""
    first = run("filter", flight, "-o", "a.parquet", "--write-decisions", "d.csv")
    assert first.code == 0, first.err
    outlier = trajectories.read("a.parquet").outlier
    second = run("filter", flight, "-o", "b.parquet", "--decisions", "d.csv", "--write-decisions", "e.csv")
    assert second.code == 0, second.err
    assert "by hand, d.csv: " in second.out
    again = trajectories.read("b.parquet").outlier
    assert ((again == REJECTED) == np.isin(outlier, (ISOLATED, PATCH))).all()
    assert Path("e.csv").read_text().startswith(Path("d.csv").read_text().rstrip("\n"))


def test_several_logs_are_told_apart_by_their_names(run, flight):
    shutil.copy(flight, "one.csv")
    shutil.copy(flight, "two.csv")
    Path("d.csv").write_text("component,from_row,to_row,use,station\nrange,0,3,bad,two\n")
    found = run("filter", "one.csv", "two.csv", "-o", "out/", "--decisions", "d.csv", "--write-decisions", "e.csv")
    assert found.code == 0, found.err
    flags = [trajectories.read(f"out/{name}.trajectory.csv").outlier for name in ("one", "two")]
    assert [int((flag == REJECTED).sum()) for flag in flags] == [0, 4]
    assert {line.station for line in decisions.read("e.csv").lines} == {"one", "two"}
    Path("d.csv").write_text("component,from_row,to_row,use\nrange,0,3,bad\n")
    refused = run("filter", "one.csv", "two.csv", "-o", "out/", "--decisions", "d.csv")
    assert refused.code == 2
    assert "d.csv: line 2 names no station, and there are several" in refused.err


def test_what_cannot_be(run, flight):
    Path("d.csv").write_text("component,from_row,to_row,use\nrange,0,3,maybe\n")
    wrong = run("filter", flight, "--decisions", "d.csv")
    assert (wrong.code, 'd.csv: line 2: use is "maybe"' in wrong.err) == (2, True)
    Path("d.csv").write_text("component,from_s,to_s,use\nrange,1e6,2e6,bad\n")
    elsewhere = run("filter", flight, "--decisions", "d.csv")
    assert (elsewhere.code, "d.csv: no line names a reading of" in elsewhere.err) == (1, True)
    over = run("filter", flight, "--decisions", "d.csv", "--write-decisions", "d.csv")
    assert over.code == 1
    assert Path("d.csv").read_text().endswith("2e6,bad\n")
    assert "--decisions is not for --follow" in run("filter", flight, "--follow", "--decisions", "d.csv").err
