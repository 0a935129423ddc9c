"""The lines of a log that grows: a file that is replaced or overwritten, and what ends the reading."""

from __future__ import annotations

import os
import signal

import pytest

from ftproc.errors import InputError
from ftproc.live import growing
from ftproc.live.growing import Stop, blocks


def lines(path, monkeypatch, *happenings):
    """The lines with their numbers, and what is said, while these things happen to the file, one at each nap; then a
    stop is asked for."""
    stop, said, found, left = Stop(), [], [], list(happenings)

    def nap(_seconds):
        if left:
            left.pop(0)()
        else:
            stop.asked = True

    monkeypatch.setattr(growing.time, "sleep", nap)
    for block in blocks(str(path), stop, said.append):
        found += list(enumerate(block.texts, block.first))
    return found, said


def append(path, text):
    def happens():
        with path.open("a") as stream:
            stream.write(text)

    return happens


def test_a_line_is_read_when_it_is_complete(tmp_path, monkeypatch):
    path = tmp_path / "a.csv"
    path.write_text("t,R\n0,1")
    found, said = lines(path, monkeypatch, append(path, "000\n1,10"), append(path, "01\r\n2,1"))
    assert found == [(1, "t,R"), (2, "0,1000"), (3, "1,1001")]  # the last one has no end
    assert not said


def test_a_file_that_is_replaced_goes_on_at_the_beginning_of_the_new_one(tmp_path, monkeypatch):
    path = tmp_path / "a.csv"
    path.write_text("t,R\n0,1000\n")

    def rotated():
        path.rename(tmp_path / "a.csv.1")
        append(tmp_path / "a.csv.1", "1,1001\n2,10")()  # the writer goes on for a while

    found, said = lines(path, monkeypatch, rotated, lambda: path.write_text("t,R\n3,1003\n"), lambda: None)
    assert found == [(1, "t,R"), (2, "0,1000"), (3, "1,1001"), (1, "t,R"), (2, "3,1003")]
    (sentence,) = said
    assert "a.csv: was replaced by another file, and is read on from the beginning" in sentence
    assert "The last line of the old content was not complete" in sentence


@pytest.mark.parametrize("more", ["", "4,1004\n5,1005\n6,1006\n7,1007\n"])
def test_a_file_that_is_written_anew_is_read_from_its_beginning(tmp_path, monkeypatch, more):
    """Also when it is longer at once than it was."""
    path = tmp_path / "a.csv"
    path.write_text("t,R\n0,1000\n1,1001\n")
    found, said = lines(path, monkeypatch, lambda: path.write_text(f"t,R\n3,1003\n{more}"), lambda: None)
    assert found[:3] == [(1, "t,R"), (2, "0,1000"), (3, "1,1001")]
    assert [text for _, text in found[3:]] == ["t,R", "3,1003", *more.split()]
    assert len(said) == 1
    assert "became shorter or was overwritten" in said[0]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_signals_end_the_reading_only(tmp_path, monkeypatch, number):
    (tmp_path / "a.csv").write_text("t,R\n")
    monkeypatch.setattr(growing.time, "sleep", lambda _seconds: signal.raise_signal(number))
    before = signal.getsignal(number)
    with Stop() as stop:
        assert [block.texts for block in blocks(str(tmp_path / "a.csv"), stop, print)] == [["t,R"]]
    assert stop.asked
    assert signal.getsignal(number) == before


def test_nohup_stays_deaf():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with Stop() as stop:
            signal.raise_signal(signal.SIGHUP)
        assert not stop.asked
    finally:
        signal.signal(signal.SIGHUP, before)


@pytest.mark.parametrize(
    ("name", "content", "sentence"),
    [
        ("none.csv", None, "none.csv: there is no such file."),
        (".", None, ": this is a directory; name a file in it."),
        ("a.csv.gz", b"\x1f\x8b\x08\x00", "a.csv.gz: this is packed (gzip), and --follow reads plain text. Filter it"),
        ("a.csv", "t,R\n".encode("utf-16"), "a.csv: --follow reads text in columns (UTF-8), such as CSV"),
        ("a.jsonl", b'{"time_s": 0, "range_m": 1000}\n', "a.jsonl: --follow reads text in columns (UTF-8), such as"),
        ("a.csv", b"t,R\n" + b"0" * 300_000, "a.csv: line 2 has no end within 256 KiB, which is no row of a log"),
    ],
)
def test_what_cannot_be_followed_is_named(tmp_path, monkeypatch, name, content, sentence):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError) as error:
        lines(tmp_path / name, monkeypatch)
    assert sentence in str(error.value)


def test_a_pipe_is_followed_before_and_after_somebody_writes_into_it(tmp_path, monkeypatch):
    path = tmp_path / "pipe"
    os.mkfifo(path)
    found, said = lines(path, monkeypatch, lambda: None, append(path, "t,R\n0,1"), append(path, "000\n"), lambda: None)
    assert found == [(1, "t,R"), (2, "0,1000")]
    assert not said


@pytest.mark.parametrize("step", [1, 2, 5, 1000])
def test_lines_are_the_same_however_their_bytes_come(monkeypatch, step):
    text = b"t,R\r\n\n0,1000\n\n\n" + b"1" * 5000 + b"\n\xef\xbb\xbf2,1002\n3,10"
    pieces = [text[low : low + step] for low in range(0, len(text), step)] + [b""]
    monkeypatch.setattr(growing._Input, "look", lambda _self: pieces.pop(0))
    found = [text for block in blocks("-", Stop(), print) for text in block.texts]
    assert found == ["t,R", "", "0,1000", "", "", "1" * 5000, "2,1002", "3,10"]


def test_nothing_more_is_begun_when_a_stop_is_overdue(monkeypatch):
    stop, pieces = Stop(), [b"1,2\n" * 10_000, b""]
    monkeypatch.setattr(growing._Input, "look", lambda _self: pieces.pop(0))
    found = blocks("-", stop, print)
    assert len(next(found).texts) == growing.LINES
    stop._ask(signal.SIGTERM, None)
    assert len(next(found).texts) == growing.LINES  # for a while
    monkeypatch.setattr(growing, "GRACE_S", -1.0)
    assert stop.overdue
    assert list(found) == []


def test_a_uri_cannot_be_followed():
    with pytest.raises(InputError, match="--follow reads a file of this machine, or - for standard input"):
        next(blocks("s3://bucket/a.csv", Stop(), print))
