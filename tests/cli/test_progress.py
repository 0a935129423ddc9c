"""The progress line."""

from __future__ import annotations

import io
import time

from ftproc.cli.progress import Progress


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def shown(stream: io.StringIO, times: list[float]) -> str:
    ticks = iter([0.0, *times])
    with Progress(stream=stream, clock=lambda: next(ticks)) as progress:
        for number, _ in enumerate(times):
            progress("filtering", number + 1, len(times))
    return stream.getvalue()


def test_nothing_for_short_work():
    assert shown(Terminal(), [0.5, 1.0, 1.9]) == ""


def test_no_bar_into_a_file():
    assert shown(io.StringIO(), [5.0, 10.0]) == ""


def test_a_line_now_and_then_into_a_file(monkeypatch):
    """Also while no step ends."""
    monkeypatch.setattr("ftproc.cli.progress.LINE_S", 0.05)
    stream = io.StringIO()
    with Progress("filtering", 400, stream=stream) as progress:
        progress.step()
        time.sleep(0.3)
    lines = stream.getvalue().splitlines()
    assert len(lines) >= 2
    assert set(lines) == {"ftproc: filtering: 1 of 400 done in 0 min"}
    time.sleep(0.1)
    assert stream.getvalue().splitlines() == lines


def test_long_work_shows_and_leaves_no_trace():
    text = shown(Terminal(), [1.0, 3.0, 3.01, 10.0])
    lines = text.split("\r")
    assert [line.split("] ")[1] for line in lines if "]" in line] == ["2/4", "4/4"]
    assert lines[-1] == ""
    assert lines[-2].strip() == ""
    assert len(lines[-2]) == len(lines[1])
