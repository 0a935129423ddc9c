"""Clocks that restart while the target goes on, and sessions that begin again."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from ftproc.files.reading import logs
from ftproc.records import FloatArray
from tests.files.conftest import Make, refused
from tests.files.mutations import flight

FLIGHT = flight("cruise")
READINGS = [f"{r:.3f},{a:.5f},{e:.5f}" for r, a, e in zip(FLIGHT.r, *np.degrees(FLIGHT[2:]), strict=True)]
#: of a flight of 60 s
TIMES: dict[str, tuple[str, Callable[[FloatArray], object]]] = {
    "seconds of the minute": ("Sec", lambda t: f"{(t + 20.5) % 60:.1f}"),
    "seconds of the hour": ("time_s", lambda t: f"{(t + 3570.5) % 3600:.1f}"),
    "minutes and seconds": ("Min,Sec", lambda t: f"{(t + 3570.5) // 60 % 60:.0f},{(t + 3570.5) % 60:.1f}"),
    "the same in one name": ("Time_min,Time_sec", lambda t: f"{(t + 20.5) // 60:.0f},{(t + 20.5) % 60:.1f}"),
    "hours and minutes": ("hour,min", lambda t: f"{10 + (t + 3570) // 3600:.0f},{(t + 3570) / 60 % 60:.6f}"),
    "minutes beside the same in seconds": ("Time (min),Time (s)", lambda t: f"{t / 60:.6f},{t:.1f}"),
    "ms in 16 bits": ("time_ms", lambda t: round(t * 1000 + 30000) % 2**16),
    "ms in 16 bits, unsaid": ("t", lambda t: round(t * 1000 + 30000) % 2**16),
    "ms in 16 bits with a sign": ("time_ms", lambda t: (round(t * 1000) + 2**15 + 2000) % 2**16 - 2**15),
    "us in 32 bits": ("time_us", lambda t: (round(t * 1e6) - 30_000_000) % 2**32),
    "us in 32 bits, in s": ("time_s", lambda t: (round(t * 1e6) - 30_000_000) % 2**32 / 1e6),
    "ticks of 2 ms": ("Time (2 ms)", lambda t: (round(t * 500) - 10_000) % 2**16),
}


def text(head: str, times: list[object], readings: list[str] = READINGS) -> str:
    rows = (f"{time},{reading}" for time, reading in zip(times, readings, strict=True))
    return "\n".join([f"{head},range_m,az_deg,el_deg", *rows, ""])


@pytest.mark.parametrize(("head", "written"), TIMES.values(), ids=TIMES)
def test_times_go_on_where_their_clock_restarts(make: Make, head: str, written: Callable[[float], object]) -> None:
    log = logs.read(make(text(head, [written(t) for t in FLIGHT.t.tolist()])))
    np.testing.assert_allclose(log.time_s - log.time_s[0], FLIGHT.t, atol=1e-4)
    assert not log.rows_out_of_order


def test_a_restart_is_said(make: Make) -> None:
    log = logs.read(make(text("time_ms", [round(t * 1000 + 30000) % 2**16 for t in FLIGHT.t.tolist()])))
    assert any("restarts as a counter of 16 bits does, once at row 356" in remark for remark in log.remarks)


@pytest.mark.parametrize(
    ("period", "back"),
    [(59.9, "from 59.85 s to 0 s"), (60.0, "from 59.95 s to 0 s"), (65.536, "from 65.5 s to 0.014 s")],
)
def test_sessions_that_begin_again_are_said(make: Make, period: float, back: str) -> None:
    """Though the second begins as a clock that restarts would: it is elsewhere."""
    times = np.arange(0, 100, 0.05)
    there = 20000 - 250 * (times >= period) * 4 - 100 * times
    readings = [
        f"{r:.3f},{30 + t / 7 + 9 * (t >= period):.5f},{5 + t / 90:.5f}" for t, r in zip(times, there, strict=True)
    ]
    said = refused(make(text("time_s", [f"{round(t % period, 4) % period:.6g}" for t in times], readings)))
    assert f"the time goes back {back}" in said
    assert "several sessions" in said


def test_minutes_that_are_no_part_are_asked_about(make: Make) -> None:
    said = refused(make(text("minutes,sec", [f"{t / 60:.6f},{t % 60 / 2:.1f}" for t in FLIGHT.t.tolist()])))
    assert 'row 1 (the first data row is 0), column "minutes + sec"' in said
    assert "not a whole number of minutes" in said


@pytest.mark.parametrize(("head", "cells"), [("t,min,max", "1,2"), ("Time (s),Min,Sec", "1,2"), ("elapsed,Min", "3")])
def test_columns_beside_a_time_are_no_parts_of_it(make: Make, head: str, cells: str) -> None:
    log = logs.read(make(text(head, [f"{t:.1f},{cells}" for t in FLIGHT.t.tolist()])))
    np.testing.assert_allclose(log.time_s, FLIGHT.t, atol=1e-9)


def moved(how: str) -> tuple[list[float], list[str]]:
    """Times and readings of a flight, out of order."""
    times, order = np.array(FLIGHT.t), np.arange(len(FLIGHT.t))
    if how == "neighbours change places":
        order = np.minimum(order ^ 1, len(order) - 1)
    elif how == "blocks change places":
        order = np.concatenate([np.array_split(order, 6)[k] for k in (3, 0, 5, 1, 4, 2)])
    elif how == "the last first":
        order = order[::-1]
    elif how.startswith("wrong times"):
        wrong = np.random.default_rng(3).permutation(len(times))[: int(how[-4:-2]) * len(times) // 100]
        times[wrong] = times[np.roll(wrong, 1)]
    else:  # of a clock that restarts in a gap
        order = order[(order < 300) | (order > 420)]
        times = (times + 30) % 65.536
    return times[order].tolist(), [READINGS[k] for k in order.tolist()]


@pytest.mark.parametrize(
    ("how", "share"),
    [
        ("neighbours change places", ""),
        ("blocks change places", ""),
        ("the last first", "100 %"),
        ("wrong times of 01 %", ""),
        ("wrong times of 10 %", "10 %"),
        ("a restart in a gap", "38 %"),
    ],
)
def test_many_rows_out_of_order_are_a_condition_unless_the_readings_agree(make: Make, how: str, share: str) -> None:
    times, readings = moved(how)
    log = logs.read(make(text("time_s", [f"{time:.3f}" for time in times], readings)))
    found = [each for each in log.understood["assumed"] if "out of order" in each]
    expected = [f"the times are right, by which {share} of the rows are out of order"] if share else []
    assert found == expected
    assert log.rows_out_of_order > 0
