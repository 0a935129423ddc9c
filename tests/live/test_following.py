"""Rows of a log that grows: a stop is heard between a few of them, and what is left out is said."""

from __future__ import annotations

import signal

import numpy as np
import pandas as pd
import pytest

from ftproc.config.recipe import Recipe
from ftproc.live import publishing, sources, stream
from ftproc.live import stop as stop_module
from ftproc.live.following import Following
from ftproc.live.live import Live
from ftproc.live.stop import Stop
from ftproc.live.stream import Stream
from ftproc.settings import FilterSettings
from tests.trust.streams import BAD_TIMES, flight, lines

HEADER = "time_s,range_m,azimuth_rad,elevation_rad\n"


def followed(tmp_path, monkeypatch, rows, stop=None):
    """The numbers of the rows that are published, and what is said, of a file that does not grow."""
    stop, said, path = stop or Stop(), [], tmp_path / "a.csv"
    path.write_text(HEADER + "".join(f"{row}\n" for row in rows))
    monkeypatch.setattr(sources.time, "sleep", lambda _seconds: stop._ask(signal.SIGTERM, None))
    log = Stream(str(path), Recipe(settings=FilterSettings(editing="live")), said.append)
    parts = [part for part in Following(log, stop, said.append).rows() if part is not None]
    return np.concatenate([part.row for part in parts]), said


def of_flight(count):
    return lines(flight().log.time_s[:count], np.arange(count))


def test_a_stop_that_is_overdue_leaves_out_what_was_read_and_says_so(tmp_path, monkeypatch):
    stop = Stop()
    push = Live.push

    def slowly(self, *rows, **beside):
        if self._taken > 30:
            stop._ask(signal.SIGINT, None)
            monkeypatch.setattr(stop_module, "GRACE_S", -1.0)
        return push(self, *rows, **beside)

    monkeypatch.setattr(Live, "push", slowly)
    monkeypatch.setattr(stream, "AT_ONCE_S", 0.0)  # so that rows are pushed one by one
    rows, said = followed(tmp_path, monkeypatch, of_flight(100), stop)
    assert rows.tolist() == list(range(32))
    assert said[-1].endswith("a.csv: stopped before 68 rows that had been read were used.")


def test_rows_that_have_been_read_are_used_after_a_stop(tmp_path, monkeypatch):
    stop = Stop()
    push = Live.push
    monkeypatch.setattr(
        Live, "push", lambda self, *rows, **more: (stop._ask(signal.SIGINT, None), push(self, *rows, **more))[1]
    )
    rows, said = followed(tmp_path, monkeypatch, of_flight(100), stop)
    assert rows.tolist() == list(range(100))
    assert not any("stopped before" in sentence for sentence in said)


@pytest.mark.parametrize("at_once_s", [0.0, 1e9])
def test_what_is_published_does_not_depend_on_how_much_is_pushed_at_once(tmp_path, monkeypatch, at_once_s):
    monkeypatch.setattr(stream, "AT_ONCE_S", at_once_s)
    rows, _ = followed(tmp_path, monkeypatch, of_flight(120))
    assert rows.tolist() == list(range(120))


def test_a_time_that_would_make_all_others_late_is_left_out(tmp_path, monkeypatch):
    good_s = flight().log.time_s
    times = np.concatenate([good_s[:100], BAD_TIMES["a row in 30 years"](0.0), good_s[100:]])
    rows, said = followed(tmp_path, monkeypatch, lines(times, np.arange(len(times))))
    assert rows.tolist() == [k for k in range(len(times)) if k != 100]
    assert "a.csv: row 100 has the time 1000000000 s, far ahead of the rows around it, and is left out." in said[0]


def test_a_run_that_is_killed_in_its_first_piece_of_the_log_is_gone_on_with(tmp_path, monkeypatch):
    log, out, state = (tmp_path / name for name in ("a.csv", "out.csv", "state"))
    log.write_text(HEADER + "".join(f"{row}\n" for row in of_flight(100)))
    request = publishing.Request(str(log), str(out), state=str(state))
    recipe, said = Recipe(settings=FilterSettings(editing="live")), list[str]()

    class Killed(BaseException):
        """Nothing is closed, as nothing would be."""

    monkeypatch.setattr(Live, "push", lambda self, *rows, **more: (_ for _ in ()).throw(Killed))
    with pytest.raises(Killed):
        publishing.follow_log(request, recipe, said.append)
    monkeypatch.undo()
    stop = Stop()
    monkeypatch.setattr(publishing, "Stop", lambda: stop)
    monkeypatch.setattr(sources.time, "sleep", lambda _seconds: stop._ask(signal.SIGTERM, None))
    publishing.follow_log(request, recipe, said.append)
    assert [line for line in said if "goes on after" in line]
    assert pd.read_csv(out)["row"].tolist() == list(range(100))
