"""ASTERIX as it comes: plots become rows, however the bytes are cut, beside other records, and over midnight."""

from __future__ import annotations

import socket

import numpy as np
import pytest

from ftproc.config.recipe import Recipe
from ftproc.errors import InputError
from ftproc.live.lines.plots import Plots, is_asterix
from ftproc.live.sources import Udp
from ftproc.live.state import packed, unpacked
from ftproc.live.stop import Stop
from ftproc.live.stream import Stream
from ftproc.settings import FilterSettings
from tests.files.zoo.flight import MIDNIGHT_START
from tests.files.zoo.radars import ICAO, block, plot_010, plot_048, readings, sector, track_001

RECIPE = Recipe(settings=FilterSettings(editing="live", lag_s=0.5))
PLOTS = {48: plot_048, 10: plot_010, 1: track_001}


def table(parts):
    """The lines of a table that come of some bytes."""
    plots = Plots()
    return [line for part in parts for piece in plots.blocks(part) for line in piece.texts], plots


def followed(data, recipe=RECIPE):
    stream, said = Stream("-", recipe, lambda _: None), []
    try:
        found = [part for piece in data for part in stream.take(piece, 0.0, Stop())]
        found += list(stream.finish(Stop()))
    except InputError as error:
        said.append(str(error))
    return stream, found, said


@pytest.mark.parametrize("category", PLOTS)
def test_plots_are_rows_in_metres_and_degrees(category):
    rows = list(readings())
    lines, _ = table([block(category, PLOTS[category](*row)) for row in rows])
    assert lines[0] == "time_s,target,range_m,azimuth_deg"
    cells = [line.split(",") for line in lines[1:]]
    found = np.array([[float(t), float(r), float(a)] for t, _, r, a in cells])
    t, r, a = np.array(rows).T
    np.testing.assert_allclose(found[:, 0] - found[0, 0], t - t[0], atol=1.01 / 128)
    np.testing.assert_allclose(found[:, 1], r, atol=7.3)
    np.testing.assert_allclose(np.exp(1j * np.radians(found[:, 2])), np.exp(1j * a), atol=5e-5)
    assert {target for _, target, _, _ in cells} == {"12" if category == 1 else f"{ICAO[0]:06X}"}


def test_blocks_may_be_cut_anywhere_and_stand_beside_others():
    rows = [block(48, plot_048(*row)) + sector(k) + block(21, bytes(9)) for k, row in enumerate(readings())]
    whole = b"".join(rows)
    expected, _ = table([whole])
    for size in (1, 7, 100):
        assert table([whole[k : k + size] for k in range(0, len(whole), size)])[0] == expected
    assert len(expected) == 1 + len(rows)


def test_times_go_on_over_midnight():
    lines, plots = table(block(48, plot_048(*row)) for row in readings(0, MIDNIGHT_START))
    times = [float(line.partition(",")[0]) for line in lines[1:]]
    assert times[0] < 86_400 < times[-1]
    assert (np.diff(times) > 0).all()
    again = unpacked(packed(plots))
    later = next(again.blocks(block(48, plot_048(2.0, 1e4, 1.0))))
    assert later.texts[0].startswith("86402.0,")


def test_a_stream_of_plots_counts_azimuths_from_north():
    """And each aircraft has a track."""
    data = [block(48, plot_048(t, r, a, ICAO[k % 2])) for k, (t, r, a) in enumerate(readings())]
    stream, found, said = followed(data, Recipe(settings=RECIPE.settings, target="target"))
    assert not said
    assert sorted(stream.tracks) == sorted(f"{each:06X}" for each in ICAO)
    assert stream.recipe.station.azimuth_from == "north"
    one = [part for part in found if part.extra.column("target")[0].as_py() == f"{ICAO[0]:06X}"]
    azimuths = np.concatenate([part.measurement[:, 1] for part in one])
    expected = np.array([a for _, _, a in readings()])[::2]
    known = np.isfinite(azimuths)
    assert known[len(known) // 2 :].all()
    np.testing.assert_allclose(np.exp(1j * azimuths[known]), np.exp(1j * expected[known]), atol=2e-3)


@pytest.mark.parametrize(
    ("text", "expected"),
    [(b"0.5,1000,0.1,0.2\n", False), (b"\n\ntime_s,range_m\n", False), (b"\x30", False), (sector(1.0), True)],
)
def test_text_is_no_asterix(text, expected):
    assert is_asterix(text) == expected


def test_datagrams_of_blocks_stay_what_they_are():
    data = block(48, *(plot_048(*row) for row in list(readings())[:3]))
    receiver = Udp("udp://127.0.0.1:0", ("127.0.0.1", 0))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for each in (data, b"1,2,3"):
            sender.sendto(each, receiver._socket.getsockname())
        receiver.wait(5.0)
        assert receiver.poll() == data + b"1,2,3\n"
    receiver.close()
