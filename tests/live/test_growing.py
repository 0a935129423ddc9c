"""The lines of a log that grows: a file that is replaced or overwritten, and what ends the reading."""

from __future__ import annotations

import os
import re
import signal
import socket
import time
import tty

import pytest

from ftproc.errors import InputError
from ftproc.live import sources
from ftproc.live.lines.growing import LINES, Lines
from ftproc.live.sources import opened
from ftproc.live.stop import Stop


def lines(path, monkeypatch, *happenings):
    """The lines with their numbers, and what is said, while these things happen to the file, one at each nap; then a
    stop is asked for."""
    stop, found, left = Stop(), [], list(happenings)

    def nap(_seconds):
        if left:
            left.pop(0)()
        else:
            stop.asked = True

    monkeypatch.setattr(sources.time, "sleep", nap)
    return read(path, stop, found)


def read(path, stop, found):
    """The same, of all that comes until a stop."""
    said, complete = [], Lines(str(path))
    with opened(str(path)) as source:
        while (data := stop.read(source)) != b"":
            if source.news:
                said.append(source.news + " cut" * complete.begin_again())
                source.news = ""
            else:
                for block in complete.blocks(data):
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
    assert sentence == "was replaced by another file cut"


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
    monkeypatch.setattr(sources.time, "sleep", lambda _seconds: signal.raise_signal(number))
    before = signal.getsignal(number)
    with Stop() as stop:
        assert read(tmp_path / "a.csv", stop, []) == ([(1, "t,R")], [])
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
        ("a.csv", "t,R\n".encode("utf-16"), "a.csv: --follow reads text in lines (UTF-8), such as CSV"),
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
def test_lines_are_the_same_however_their_bytes_come(step):
    text = b"t,R\r\n\n0,1000\n\n\n" + b"1" * 5000 + b"\n\xef\xbb\xbf2,1002\n3,10"
    pieces = [text[low : low + step] for low in range(0, len(text), step)]
    complete, found = Lines("-"), []
    for piece in pieces:
        found += [text for block in complete.blocks(piece) for text in block.texts]
    assert found == ["t,R", "", "0,1000", "", "", "1" * 5000, "2,1002"]
    assert [block.texts for block in complete.last()] == [["3,10"]]


def test_many_lines_are_taken_some_at_a_time():
    found = [len(block.texts) for block in Lines("-").blocks(b"1,2\n" * 10_000)]
    assert found == [LINES, LINES, 10_000 - 2 * LINES]


@pytest.mark.parametrize(
    ("source", "sentence"),
    [
        ("s3://bucket/a.csv", "--follow reads a file of this machine, udp://HOST:PORT, tcp://HOST:PORT, or - for"),
        ("udp://127.0.0.1", "this is no address; expected such as udp://0.0.0.0:5000 or tcp://10.0.0.7:5000."),
        ("tcp://127.0.0.1:99999", "this is no address"),
        ("tcp://:0", "this is no address"),
        ("udp://192.0.2.1:5000", "cannot be listened to"),
        ("udp://no.such.host.invalid:5000", "there is no such host"),
    ],
)
def test_a_source_that_cannot_be_opened_is_named(source, sentence):
    with pytest.raises(InputError, match=re.escape(source)) as error, opened(source):
        pass
    assert sentence in str(error.value)


def port(kind):
    with socket.socket(socket.AF_INET, kind) as made:
        made.bind(("127.0.0.1", 0))
        return made.getsockname()[1]


def test_datagrams_are_whole_lines():
    number = port(socket.SOCK_DGRAM)
    with opened(f"udp://127.0.0.1:{number}") as source, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        assert Stop().read(source, 0.0) is None
        for text in (b"t,R", b"0,1\n1,2", b"2,3\n"):
            sender.sendto(text, ("127.0.0.1", number))
        assert Stop().read(source, time.monotonic() + 10) == b"t,R\n0,1\n1,2\n2,3\n"


@pytest.mark.parametrize("who", ["sender", "program"])
def test_either_side_of_a_connection_may_listen(who):
    number = port(socket.SOCK_STREAM)
    with socket.socket() as sender, opened(f"tcp://127.0.0.1:{number}") as source:
        if who == "sender":
            sender.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            sender.bind(("127.0.0.1", number))
            sender.listen()
            assert Stop().read(source, 0.0) is None
            stream, _ = sender.accept()
        else:
            assert Stop().read(source, 0.0) is None
            sender.connect(("127.0.0.1", number))
            stream = sender
        stream.sendall(b"t,R\n0,1")
        found = b""
        while len(found) < 7:
            found += Stop().read(source, time.monotonic() + 10)
        stream.close()
        assert found == b"t,R\n0,1"
        assert Stop().read(source, time.monotonic() + 10) == b""  # closed: the end of the input


def test_a_serial_line_is_followed(monkeypatch):
    """A terminal that stands for it."""
    ours, its = os.openpty()
    tty.setraw(its)
    os.write(ours, b"t,R\r\n0,1000\r\n")
    found, _ = lines(os.ttyname(its), monkeypatch, lambda: os.write(ours, b"1,1001\r\n"), lambda: None)
    os.close(ours)
    os.close(its)
    assert found == [(1, "t,R"), (2, "0,1000"), (3, "1,1001")]
