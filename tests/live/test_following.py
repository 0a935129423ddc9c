"""Rows of a log that grows: a stop is heard between a few of them, and what is left out is said."""

from __future__ import annotations

import signal
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from ftproc.config.recipe import Recipe
from ftproc.live import following, publishing, sources, stream
from ftproc.live import stop as stop_module
from ftproc.live.following import Following
from ftproc.live.live import Live
from ftproc.live.stop import Stop
from ftproc.live.stream import Stream
from ftproc.settings import FilterSettings
from ftproc.simulation import simulate
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


class Sender:
    """A source of which something has come whenever it is asked, and a clock that goes on by so much each time."""

    news = ""

    def __init__(self, pieces, step_s):
        self.pieces, self.step_s, self.now_s = iter([*pieces, b""]), step_s, 0.0

    def poll(self):
        self.now_s += self.step_s
        return next(self.pieces)


def sent(monkeypatch, log, at_once, lag_s, step_s=0.0, push_s=0.0):
    """What is published of a log whose rows come so many at once, part by part, and when. step_s: from one time that
    something comes to the next. push_s: that a push takes."""
    rows = [",".join(map(repr, row)) + "\n" for row in np.column_stack([log.time_s, log.measurement]).tolist()]
    pieces = ["".join(rows[low : low + at_once]) for low in range(0, len(rows), at_once)]
    sender, push = Sender([text.encode() for text in (HEADER + pieces[0], *pieces[1:])], step_s), Live.push

    def slowly(self, *rows, **more):
        sender.now_s += push_s
        return push(self, *rows, **more)

    with monkeypatch.context() as patch:
        patch.setattr(Live, "push", slowly)
        patch.setattr(following, "time", SimpleNamespace(monotonic=lambda: sender.now_s))
        stream_ = Stream("-", Recipe(settings=FilterSettings(editing="live", lag_s=lag_s)), lambda _: None)
        track = Following(stream_, Stop(), lambda _: None)
        found = [(part, sender.now_s) for part in track._follow(sender) if part is not None]
        return [*found, *((part, sender.now_s) for part in stream_.finish(track.stop))]


def test_rows_leave_when_their_lag_has_passed_though_more_has_come(monkeypatch):
    """Where that is slower than the readings, there is always more."""
    log = simulate("cruise", seed=4, duration_s=12.0, dt_s=0.05).log
    begin_s, waited = log.time_s[0] - 0.05, np.zeros(0)
    for part, now_s in sent(monkeypatch, log, 1, 0.5, step_s=0.05):
        waited = np.append(waited, now_s + begin_s - part.time_s)
    assert len(waited) == len(log)
    assert np.quantile(waited, 0.95) < 0.5 + 0.11


def test_the_clock_stands_while_the_sender_waits(monkeypatch):
    """Nobody knows then when the next readings would have come."""
    log, at_once = simulate("cruise", seed=4, duration_s=40.0, dt_s=0.05).log, 280
    slow, fast = ([part for part, _ in sent(monkeypatch, log, at_once, 15.0, push_s=each)] for each in (5.0, 0.0))
    for name in ("row", "state"):
        one, other = (np.concatenate([getattr(part, name) for part in parts]) for parts in (slow, fast))
        np.testing.assert_array_equal(one, other)
