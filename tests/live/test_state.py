"""What a stream keeps: its values, files that are not such, and going on after any moment at which a run was killed."""

from __future__ import annotations

import copy
import functools
import itertools
from collections import deque
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from ftproc.config.recipe import Recipe
from ftproc.core.editing import two_pass
from ftproc.core.filtering.records import Start
from ftproc.errors import InputError
from ftproc.live import publishing, sources, state
from ftproc.live.lines.growing import Lines
from ftproc.live.publishing import Request, follow_log
from ftproc.live.state import Entry, Kind, StateFile, packed, unpacked
from ftproc.settings import FilterSettings
from tests.live.test_stream import csv

RECIPE = Recipe(settings=FilterSettings(editing="live", lag_s=0.5))


def test_values_come_back_as_they_were():
    lines = Lines("a")
    list(lines.blocks(b"x\ny"))
    records = np.zeros(2, [("a", float), ("b", float, (3,))])
    value = {
        "plain": [None, True, 3, 0.1, float("inf"), "text"], "many": (1, (2.5,), deque([1])), 5: {"deep": b"\0\xff"},
        "named": Start(3, np.arange(9.0), np.eye(9)), "lines": lines, "records": records,
        "work": functools.partial(two_pass.edit, np.arange(3.0), live=True),
    }  # fmt: skip
    found = unpacked(packed(value))
    assert [*found] == [*value]
    assert found["plain"] == value["plain"]
    assert found["many"] == value["many"]
    assert found[5] == value[5]
    assert (found["named"].sample, found["named"].covariance.tolist()) == (3, np.eye(9).tolist())
    assert found["lines"].__dict__ == lines.__dict__
    np.testing.assert_array_equal(found["records"], records)
    assert (found["work"].func, found["work"].keywords) == (two_pass.edit, {"live": True})


@pytest.mark.parametrize("value", [object(), print, Path("a"), {1, 2}])
def test_nothing_else_is_kept(value):
    with pytest.raises(TypeError, match="cannot be kept"):
        packed(value)


@pytest.mark.parametrize(
    ("text", "words"),
    [(b"", "is no state"), (b"time_s,range_m\n", "is no state"), (state.MAGIC + b"\0" * 40, "is no state")],
)
def test_other_files_are_refused_and_left(tmp_path, text, words):
    (tmp_path / "a").write_bytes(text)
    with pytest.raises(InputError, match=words):
        StateFile(tmp_path / "a", "this")
    assert (tmp_path / "a").read_bytes() == text


def test_damage_and_other_streams_are_refused(tmp_path):
    path = tmp_path / "a"
    file = StateFile(path, "this")
    file.replace({"a": 1})
    file.add(Entry(1.5, Kind.DATA, b"1,2\n"))
    file.add(Entry(2.5, Kind.TICK))
    file.close()
    again = StateFile(path, "this")
    assert (again.known, again.since) == ({"a": 1}, [Entry(1.5, Kind.DATA, b"1,2\n"), Entry(2.5, Kind.TICK)])
    with pytest.raises(InputError, match="the state of another stream, or of other options"):
        StateFile(path, "that")
    whole = path.read_bytes()
    path.write_bytes(whole[:-3])  # killed while it was written
    assert StateFile(path, "this").since == [Entry(1.5, Kind.DATA, b"1,2\n")]
    path.write_bytes(whole[:60] + bytes([whole[60] ^ 1]) + whole[61:])
    with pytest.raises(InputError, match="is no state of a stream"):
        StateFile(path, "this")


class Killed(BaseException):
    """As a process that is killed: nothing is done after it."""


@pytest.mark.parametrize(
    ("output", "kept_every_s"),
    [
        pytest.param(output, kept_every_s, marks=[] if (k % 2 == 0) == (kept_every_s == 0) else pytest.mark.slow)
        for k, output in enumerate(["out.csv", "out.jsonl", "out.csv.gz", "out.parquet"])
        for kept_every_s in (0.0, 1e9)
    ],
)
def test_after_any_moment_it_goes_on_as_if_nothing_had_been(tmp_path, monkeypatch, output, kept_every_s):
    """Killed after each so many writes to a file, in a stream that comes a little at a time, with late rows."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(publishing, "KEEP_S", kept_every_s)
    text = csv()
    text[30:33] = [text[32], text[30], text[31]]
    text = "".join(text)
    pieces = [text[low : low + 150].encode() for low in range(0, len(text), 150)]
    once = run(tmp_path, monkeypatch, pieces, Request("log", "once" + output[3:]), None)
    assert once == ""
    moments = itertools.cycle((3, 11, 24, 2, 40, 57))
    Path("log").write_bytes(b"")
    for _ in range(200):
        if run(tmp_path, monkeypatch, pieces, Request("log", output, state="state"), next(moments)) == "":
            break
    pd.testing.assert_frame_equal(table(output), table("once" + output[3:]))
    if output in ("out.csv", "out.jsonl"):
        assert Path(output).read_bytes() == Path("once" + output[3:]).read_bytes()


def table(name):
    kind = name.partition(".")[2]
    return pd.read_json(name, lines=True) if kind == "jsonl" else getattr(pd, f"read_{kind[:3]}", pd.read_parquet)(name)


def run(folder, monkeypatch, pieces, request, killed_after):
    """Follow a file that grows by these pieces as it is read; killed after so many polls of it."""
    log, polls = folder / "log", itertools.count()
    whole = b"".join(pieces)
    poll = sources.File.poll

    def grow(self):
        if killed_after is not None and next(polls) >= killed_after:
            raise Killed
        size = log.stat().st_size if log.exists() else 0
        if size < len(whole):
            with log.open("ab") as file:
                file.write(whole[size : size + len(pieces[0])])
        found = poll(self)
        if found is None and size >= len(whole):
            return b""
        return found

    if not log.exists():
        log.write_bytes(b"")
    with monkeypatch.context() as patch:
        patch.setattr(sources.File, "poll", grow)
        try:
            follow_log(request, copy.deepcopy(RECIPE), lambda _: None)
        except Killed:
            return "killed"
    return ""
