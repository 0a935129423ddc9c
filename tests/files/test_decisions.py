"""Decisions by hand: the file, what its lines mean for a log, and those that give a trajectory's decisions again."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ftproc.errors import InputError, UsageError
from ftproc.files import decisions
from ftproc.files.writing.decisions import write
from ftproc.records import ACCEPTED, ENDS, GOOD, ISOLATED, MISSING, PATCH, REJECTED, ByHand, Line, MeasurementLog

HEAD = "component,from_s,to_s,use,reason\n"


def log(times: list[float] | None = None, n: int = 10) -> MeasurementLog:
    time_s = np.arange(n, dtype=float) if times is None else np.array(times)
    return MeasurementLog("flight.csv", time_s, np.ones((len(time_s), 3)), np.arange(len(time_s)))


def read(tmp_path: Path, text: str) -> decisions.Decisions:
    path = tmp_path / "d.csv"
    path.write_text(text)
    return decisions.read(path)


def flags(tmp_path: Path, text: str, of: MeasurementLog | None = None, station: str = "") -> np.ndarray:
    found = read(tmp_path, text).applied(of or log(), station).by_hand
    assert found is not None
    return found.flags


def test_lines_name_components_times_and_rows(tmp_path: Path) -> None:
    found = flags(tmp_path, "component,from_s,to_s,from_row,to_row,use\nrange,2,4,,,bad\nAll,,,6,6,good\n")
    expected = np.zeros((10, 3))
    expected[2:5, 0], expected[6] = REJECTED, ACCEPTED
    assert (found == expected).all()


def test_of_lines_on_the_same_reading_the_last_counts(tmp_path: Path) -> None:
    found = flags(tmp_path, f"{HEAD}all,0,9,bad,\nazimuth,3,3,auto,\nazimuth,4,4,good,\n")
    assert found[3].tolist() == [REJECTED, GOOD, REJECTED]
    assert found[4].tolist() == [REJECTED, ACCEPTED, REJECTED]


def test_rows_are_those_of_the_file(tmp_path: Path) -> None:
    """Also where the log was out of order, and rows without a time are left out."""
    shuffled = replace(log(), row=np.array([4, 1, 2, 3, 0, 5, 7, 8, 9, 12]))
    found = flags(tmp_path, "component,from_row,to_row,use\nrange,0,1,bad\nrange,9,20,bad\n", shuffled)
    assert np.flatnonzero(found[:, 0]).tolist() == [1, 4, 8, 9]


def test_a_missing_reading_is_not_decided_on(tmp_path: Path) -> None:
    holey = log()
    holey.measurement[3, 0] = np.nan
    assert flags(tmp_path, f"{HEAD}all,3,3,good,\n", holey)[3].tolist() == [GOOD, ACCEPTED, ACCEPTED]


def test_as_a_spreadsheet_saves_it(tmp_path: Path) -> None:
    """With a mark at the beginning, semicolons, decimal commas, remarks and blanks."""
    text = '\ufeff# of flight 12\nUse;Component;from_s;to_s;reason\n\nbad ; range;2,5;"4,0";"hangar; again"\n;;;;\n'
    (line,) = read(tmp_path, text).lines
    assert (line.number, line.first, line.last, line.reason) == (4, 2.5, 4.0, "hangar; again")


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "d.csv: the file is empty; expected a header line"),
        ("component,from_s,use\n", "there is no column from_s and to_s, or from_row and to_row"),
        ("from_s,to_s,use\n", "there is no column component"),
        ("component,from_s,to_s,use,reson\n", 'column "reson" is not known; did you mean'),
        ("component,from_s,to_s,use,use\n", 'column "use" is there twice'),
        (f"{HEAD}rng,1,2,bad,\n", 'd.csv: line 2: component is "rng", expected one of range, azimuth'),
        (f"{HEAD}range,1,2,wrong,\n", 'line 2: use is "wrong", expected one of auto, bad, good'),
        (f"{HEAD}range,1,2,bad,\nrange,9:30,2,bad,\n", 'line 3: from_s is "9:30", expected seconds'),
        (f"{HEAD}range,1,inf,bad,\n", 'line 2: to_s is "inf", expected seconds'),
        (f"{HEAD}range,5,2,bad,\n", "line 2: to_s is 2, before from_s, 5; exchange them"),
        (f"{HEAD}range,,,bad,\n", "line 2 has neither times nor rows"),
        (f"{HEAD}range,1,2,bad,a,b\n", "line 2 has 6 cells under 5 names"),
        (f'{HEAD}range,1,2,bad,"a\n', "is not CSV"),
        ("component,from_row,to_row,use\nrange,1.5,2,bad\n", 'from_row is "1.5", expected a row number'),
        ("component,from_s,to_s,from_row,to_row,use\nrange,1,2,3,4,bad\n", "line 2 has both times and rows"),
    ],
)
def test_what_is_not_understood_is_said_with_its_line(tmp_path: Path, text: str, sentence: str) -> None:
    with pytest.raises(UsageError) as error:
        read(tmp_path, text)
    assert sentence in str(error.value)


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    (tmp_path / "latin.csv").write_bytes(HEAD.encode() + b"range,1,2,bad,M\xfcnchen\n")
    for name, sentence in (("none.csv", "no such file"), ("latin.csv", "not UTF-8"), (".", "cannot be read")):
        with pytest.raises(UsageError, match=sentence):
            decisions.read(tmp_path / name)


def test_lines_for_other_times_or_other_logs(tmp_path: Path) -> None:
    with pytest.raises(
        InputError, match=r"no line names a reading of flight.csv \(times from 0 to 9 s, rows from 0 to 9"
    ):
        read(tmp_path, f"{HEAD}range,100,200,bad,\n").applied(log())
    both = read(tmp_path, "component,from_s,to_s,use,station\nrange,1,1,bad,radar\nrange,2,2,bad,optics\n")
    assert both.applied(log(), "other").by_hand is None
    optics = both.applied(log(), "optics").by_hand
    assert optics is not None
    assert np.flatnonzero(optics.flags[:, 0]).tolist() == [2]
    with pytest.raises(UsageError, match="no line is for other"):
        both.check(["other"])
    mine = read(tmp_path, f"{HEAD}range,1,2,bad,\n")
    mine.check(["one"])
    mine.check(["one", "two"], same_clock=True)
    with pytest.raises(UsageError, match="line 2 names no station, and there are several"):
        mine.check(["one", "two"])


def test_one_of_two_readings_of_a_time_cannot_be_accepted_alone(tmp_path: Path) -> None:
    twice = log([0, 1, 1, 2])
    text = "component,from_row,to_row,use\nrange,1,1,good\n"
    with pytest.raises(InputError, match=r"rows 1 and 2 of flight.csv have the same time"):
        read(tmp_path, text).applied(twice)
    assert flags(tmp_path, f"{text}range,2,2,bad\n", twice)[:, 0].tolist() == [0, ACCEPTED, REJECTED, 0]


@pytest.mark.parametrize("times", [None, [0, 1, 1, 1, 2, 3, 3, 4, 5, 6]])
def test_what_was_taken_comes_back(tmp_path: Path, times: list[float] | None) -> None:
    """By times, or by rows where these say too much."""
    outlier = np.zeros((10, 3), np.uint8)
    outlier[2, 0], outlier[4:7, 0], outlier[9, 2], outlier[5, 0] = ISOLATED, PATCH, PATCH, MISSING
    outlier[0, 1] = REJECTED
    this = log(times)
    this.measurement[outlier == MISSING] = np.nan
    lines = list(decisions.taken(this.time_s, this.row, outlier, "radar"))
    write(lines, tmp_path / "d.csv")
    found = decisions.read(tmp_path / "d.csv").applied(this, "radar").by_hand
    assert isinstance(found, ByHand)
    assert ((found.flags == REJECTED) == np.isin(outlier, (ISOLATED, PATCH))).all()
    assert (lines[0].ends == ENDS[0]) == (times is None)
    assert "patch, 2 readings" in (tmp_path / "d.csv").read_text()


def test_a_reason_is_no_formula(tmp_path: Path) -> None:
    write([Line(0, "range", ENDS[0], 1.0, 2.0, "bad", reason="=1+1")], tmp_path / "d.csv")
    assert "'=1+1" in (tmp_path / "d.csv").read_text()


def test_nothing_taken_is_a_file_that_can_be_read(tmp_path: Path) -> None:
    write([], tmp_path / "d.csv")
    assert decisions.read(tmp_path / "d.csv").lines == ()


def test_metadata_give_the_lines_again(tmp_path: Path) -> None:
    one = read(tmp_path, "component,from_s,to_s,from_row,to_row,use,station\nrange,1,2.5,,,bad,a\nall,,,3,4,auto,\n")
    lines = [{**decisions.as_dict(line), "readings": 3} for line in one.lines]
    assert decisions.from_metadata({"file": one.name, "sha256": one.sha256, "lines": lines}) == one
