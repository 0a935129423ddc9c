"""Bytes in, rows out: forms of lines, several targets, damaged lines, and pauses."""

from __future__ import annotations

import functools
import json
import operator
from dataclasses import replace

import numpy as np
import pytest

import ftproc
from ftproc.config.recipe import Recipe
from ftproc.errors import InputError
from ftproc.live import stream as streams
from ftproc.live.stop import Stop
from ftproc.live.stream import Stream
from ftproc.settings import FilterSettings
from tests.trust.streams import flight

SETTINGS = FilterSettings(editing="live", lag_s=0.5)
NAMES = ("time_s", "range_m", "azimuth_rad", "elevation_rad")
HEADER = ",".join(NAMES) + "\n"
ROWS = 80


def rows(count=ROWS):
    log = flight().log
    return np.column_stack([log.time_s, log.measurement])[:count].tolist()


def followed(texts, recipe=Recipe(settings=SETTINGS), source="-", coast_s=0.0):  # noqa: B008
    """The stream, its parts and what it says; a text comes at each tenth of a second."""
    said, found = [], []
    stream, stop = Stream(source, recipe, said.append, coast_s), Stop()
    try:
        for k, text in enumerate(texts):
            found += list(stream.take(text.encode(), 0.1 * k, stop))
            while stream.due_s <= 0.1 * k:
                found += list(stream.tick(stream.due_s, stop))
        found += list(stream.finish(stop))
    except InputError as error:
        said.append(str(error))
    return stream, found, said


def joined(parts, name):
    return np.concatenate([getattr(part, name) for part in parts])


def csv():
    return [HEADER, *(",".join(map(repr, row)) + "\n" for row in rows())]


def of_json(row):
    time_s, *reading = row
    values = [None if np.isnan(value) else value for value in reading]
    return json.dumps({"time_s": time_s, "radar": dict(zip(NAMES[1:], values, strict=True)), "note": "a,b"}) + "\n"


def test_objects_of_json_are_understood_as_a_table_is():
    whole = followed(csv())[1]
    stream, found, said = followed(["\n", *map(of_json, rows())])
    np.testing.assert_array_equal(joined(found, "state"), joined(whole, "state"))
    np.testing.assert_array_equal(joined(found, "row"), np.arange(ROWS))
    assert not any("is no" in sentence for sentence in said)
    stream, _, (*_, error) = followed(["".join([*map(of_json, rows(5)), "{]\n"])])
    assert "line 6 is no object of JSON" in error
    assert stream.taken == 5


def nmea(row, target=1):
    time_s, range_m, azimuth_rad, _ = row
    clock = (86_396.0 + time_s) % 86_400
    bearing = f"{np.degrees(azimuth_rad) % 360:.6f}"
    utc = f"{int(clock // 3600):02}{int(clock % 3600 // 60):02}{clock % 60:06.3f}"
    text = f"RATTM,{target:02},{range_m / 1852:.6f},{bearing},T,0,0,T,0,0,N,NAME,T,,{utc},A"
    return f"${text}*{functools.reduce(operator.xor, text.encode()):02X}\r\n"


def test_targets_of_a_radar_are_tracks_across_midnight():
    """With true bearings; a damaged sentence and others are passed over."""
    texts = [nmea(row, 1 + k % 2) for k, row in enumerate(rows())]
    texts[40] = texts[40].replace("RATTM,01", "RATTM,02")  # the checksum is another one
    texts.insert(7, "$GPZDA,201530.00,04,07,2002,00,00*60\r\n")
    stream, found, _ = followed(texts, Recipe(settings=SETTINGS, target="target"))
    assert sorted(stream.tracks) == ["01", "02"]
    times = joined(found, "time_s")
    assert (times.min(), len(times)) == (86_396.0, ROWS - 1)
    np.testing.assert_allclose(np.sort(times)[-1], 86_396.0 + rows()[-1][0], atol=2e-3)
    last = [part for part in found if part.extra.column("target")[0].as_py() == "02"][-1]
    assert np.isfinite(last.measurement[-1, :2]).all()


def test_own_sentences_are_columns_by_number():
    texts = [f"$PXYZ,{','.join(map(repr, row))}\r\n" for row in rows()]
    named = Recipe(settings=SETTINGS, columns="time=1,range=2,azimuth=3,elevation=4")
    found = followed(texts, named)[1]
    np.testing.assert_array_equal(joined(found, "state"), joined(followed(csv())[1], "state"))


def of_two(row, far_m=50_000.0):
    time_s, range_m, *angles = row
    near, far = (",".join(map(repr, (time_s, r, *angles))) for r in (range_m, range_m + far_m))
    return f"{near},a\n{far},b\n"


def test_each_target_has_a_track_of_its_own():
    texts = [HEADER.replace("\n", ",who\n"), *map(of_two, rows())]
    _, found, _ = followed(texts, Recipe(settings=SETTINGS, target="who"))
    whole = joined(followed(csv())[1], "state")
    for name, first in (("a", 0), ("b", 1)):
        mine = [part for part in found if part.extra.column("who")[0].as_py() == name]
        np.testing.assert_array_equal(joined(mine, "row"), first + 2 * np.arange(ROWS))
        assert (joined(mine, "state") == whole)[~np.isnan(whole)].all() == (name == "a")
    _, one, said = followed(texts, Recipe(settings=SETTINGS, target="who=a"))
    np.testing.assert_array_equal(joined(one, "state"), whole)
    assert not [sentence for sentence in said if "left out" in sentence]
    *_, error = followed(texts, Recipe(settings=SETTINGS, target="whom"))[2]
    assert 'there is no column "whom"; its columns are time_s' in error


def test_what_is_put_off_is_done_for_one_target_at_a_time():
    """So that what comes meanwhile, and rows of others that are due, wait for no more than one."""
    stream = followed(two_targets(), Recipe(settings=SETTINGS, target="track"))[0]
    editors = [track._order.editor for track in stream.tracks.values()]
    for editor in editors:
        editor.put_off = True
    assert stream.work()
    assert [editor.put_off for editor in editors] == [False, True]
    assert stream.work()
    assert not stream.work()


def test_when_it_is_done_changes_nothing():
    def states(work):
        stream, stop, found = Stream("-", Recipe(settings=SETTINGS, target="track"), print, 0.0), Stop(), []
        for k, text in enumerate(two_targets()):
            found += list(stream.take(text.encode(), 0.1 * k, stop))
            work(stream)
        return joined([*found, *stream.finish(stop)], "state")

    np.testing.assert_array_equal(states(Stream.work), states(lambda _: None))


def test_targets_are_bounded(monkeypatch):
    monkeypatch.setattr(streams, "MOST_TARGETS", 3)
    texts = [HEADER.replace("\n", ",who\n"), *(f"{k},1000,0.1,0.2,{k % 5}\n" for k in range(50))]
    stream, _, said = followed(texts, Recipe(settings=SETTINGS, target="who"))
    assert len(stream.tracks) == 3
    assert "-: 20 rows are of other targets than the first 3, and are left out." in said


def test_damaged_lines_of_the_network_are_left_out_and_counted():
    texts = csv()
    for k in (9, 20, 33, 50, 51):
        texts[k] = texts[k][: len(texts[k]) // 2] + "\n"
    stream, found, said = followed(texts, source="udp://127.0.0.1:9")
    assert (stream.bad, len(joined(found, "row"))) == (5, ROWS - 5)
    assert [k for k, sentence in enumerate(said) if "cells where the header has 4" in sentence] == [0, 1, 2]
    assert said[-1] == "udp://127.0.0.1:9: 5 lines were not understood, and are left out."


def test_rows_leave_and_coast_in_a_pause():
    """As long as was asked for, and what comes later is what it was."""
    texts = csv()
    paused = [*texts[:51], *[""] * 40, *texts[51:]]
    plain = followed(paused)[1]
    _, found, _ = followed(paused, coast_s=2.0)
    row, time_s, state = (joined(found, name) for name in ("row", "time_s", "state"))
    np.testing.assert_allclose(time_s[row < 0], rows()[49][0] + 0.1 * np.arange(1, 21))
    np.testing.assert_array_equal(state[row >= 0], joined(plain, "state"))
    assert np.isfinite(state[row < 0]).all()


def with_times(change):
    """The rows of a log as text, the times of some of which are others."""
    found = rows()
    for index, time_s in change.items():
        found[index][0] = time_s
    return [HEADER, *(",".join(map(repr, row)) + "\n" for row in found)]


@pytest.mark.parametrize("at", [1, 7, 40, ROWS - 2])
def test_a_time_far_ahead_is_left_out_and_blinds_no_later_row(at):
    _, parts, said = followed(with_times({at: 150.0}))
    plain = followed([text for k, text in enumerate(csv()) if k != at + 1])[1]
    np.testing.assert_array_equal(joined(parts, "time_s"), joined(plain, "time_s"))
    np.testing.assert_array_equal(joined(parts, "state"), joined(plain, "state"))
    assert joined(parts, "row").tolist() == [k for k in range(ROWS) if k != at]
    assert f"row {at} has the time 150 s, far ahead of the rows around it, and is left out" in said[0]
    assert "1 rows have times far ahead" in said[-1]


def test_a_pause_is_no_wrong_time():
    """Each row is there, whatever comes after it; the row after a pause waits for the next one or a little while."""
    later = {k: rows()[k][0] + 500.0 for k in range(40, ROWS)}
    _, parts, said = followed(with_times(later))
    assert joined(parts, "row").tolist() == list(range(ROWS))
    assert not said
    _, parts, _ = followed(with_times({ROWS - 1: 500.0}))
    assert joined(parts, "row").tolist() == list(range(ROWS))
    found = followed([*with_times({ROWS - 1: 500.0}), *[""] * 20], source="udp://:1")[1]
    assert found[-1].row.tolist() == [ROWS - 1]


@pytest.mark.parametrize("interval_s", [0.05, 5.0, 60.0, 3600.0])
def test_rows_that_are_far_apart_are_all_there(interval_s):
    _, parts, said = followed(with_times({k: k * interval_s for k in range(ROWS)}))
    assert joined(parts, "row").tolist() == list(range(ROWS))
    assert not said


def test_a_clock_that_is_set_back_begins_a_new_track():
    back = {k: rows()[k][0] - 3600.0 for k in range(30, ROWS)}
    stream, parts, said = followed(with_times(back))
    assert joined(parts, "row").tolist() == list(range(ROWS))
    assert "the times go back from 2.9 to -3597 s and on from there; a new track begins" in said[0]
    assert stream.late == 0


def test_a_few_rows_that_are_too_late_are_counted():
    """Less than a clock that is set back would make late."""
    few = {k: rows()[k][0] - 3600.0 for k in range(30, 40)}
    stream, parts, _ = followed(with_times(few))
    assert joined(parts, "row").tolist() == [k for k in range(ROWS) if not 30 <= k < 40]
    assert stream.late == 10


def two_targets():
    """The rows of two targets in turns."""
    found = []
    for k, row in enumerate(rows()):
        found += [f"{','.join(map(repr, row))},A\n", f"{row[0]!r},{9000.0 + 3 * k!r},{2 + k / 500!r},0.5,B\n"]
    return [HEADER.replace("\n", ",track\n"), *found]


def test_the_rows_of_several_targets_are_no_one_track():
    _, _, said = followed(two_targets(), source="udp://:1")
    assert "the rows alternate between tracks. Say --target track for a track of each, or --target none" in said[-1]
    stream, _, said = followed(two_targets(), Recipe(settings=SETTINGS, target="track"))
    assert sorted(stream.tracks) == ["A", "B"]
    assert not said
    assert not followed(two_targets(), Recipe(settings=SETTINGS, target="none"))[2]


def test_a_target_that_never_comes_is_named():
    assert "no row meets track=C; check" in followed(two_targets(), Recipe(settings=SETTINGS, target="track=C"))[2][-1]


@pytest.mark.parametrize(("height", "sigma_m"), [((150.0, 20.0), 20.0), (None, 6000.0)])
def test_a_prior_of_the_height_makes_positions_as_in_a_complete_log(height, sigma_m):
    settings = replace(SETTINGS, height=height)
    texts = [line.rpartition(",")[0] + "\n" for line in csv()]
    parts = followed(texts, Recipe(settings=settings))[1]
    log = replace(flight().log.stretch(slice(0, ROWS)), measurement=flight().log.measurement[:ROWS] * [1, 1, np.nan])
    whole = ftproc.filter_log(log, settings)
    np.testing.assert_array_equal(joined(parts, "state"), whole.state)
    np.testing.assert_array_equal(joined(parts, "sigma"), whole.sigma)
    assert np.nanmax(joined(parts, "sigma")[:, 2]) == sigma_m


def test_sentences_with_a_wrong_checksum_are_counted():
    sentences = [f"$RATTM,01,{1 + k / 500:.3f},45.0,T,,,,,,N,,T,,{k // 60:02d}{k % 60:02d}00.00,A" for k in range(59)]
    texts = [f"{each}*{'00' if k % 10 == 5 else checksum(each)}\r\n" for k, each in enumerate(sentences)]
    _, _, said = followed(texts)
    assert any("sentences have a wrong checksum, and are left out" in each for each in said)


def checksum(sentence):
    code = 0
    for byte in sentence[1:].encode():
        code ^= byte
    return f"{code:02X}"


def test_decimal_commas_are_understood_where_the_separator_is_another():
    texts = [text.replace(",", ";").replace(".", ",") for text in csv()]
    _, parts, said = followed(texts)
    np.testing.assert_array_equal(joined(parts, "state"), joined(followed(csv())[1], "state"))
    assert not said
