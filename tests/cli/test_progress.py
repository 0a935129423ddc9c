"""The progress line."""

from __future__ import annotations

import io

from ftproc.cli.progress import Progress


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def shown(stream: io.StringIO, times: list[float]) -> str:
    ticks = iter([0.0, *times])
    with Progress(stream, lambda: next(ticks)) as progress:
        for number, _ in enumerate(times):
            progress("filtering", number + 1, len(times))
    return stream.getvalue()


def test_nothing_for_short_work():
    assert shown(Terminal(), [0.5, 1.0, 1.9]) == ""


def test_nothing_into_a_file():
    assert shown(io.StringIO(), [5.0, 10.0]) == ""


def test_long_work_shows_and_leaves_no_trace():
    text = shown(Terminal(), [1.0, 3.0, 3.01, 10.0])
    lines = text.split("\r")
    assert [line.split("] ")[1] for line in lines if "]" in line] == ["2/4", "4/4"]
    assert lines[-1] == ""
    assert lines[-2].strip() == ""
    assert len(lines[-2]) == len(lines[1])
