"""Files whose last line is cut off, as a logger leaves them that died: that line is left out, and the rest is read."""

from collections.abc import Callable

import numpy as np
import pytest

from ftproc.files.reading import logs
from ftproc.files.reading.formats import blocks, content, csvtext
from tests.files.conftest import Make
from tests.files.zoo.flight import flight

FLIGHT = flight()
ROWS = [*zip(FLIGHT.t, FLIGHT.r, np.degrees(FLIGHT.a), np.degrees(FLIGHT.e), strict=True)]
#: Name of a log -> its first line, and how a row is written.
WRITTEN: dict[str, tuple[str, Callable[..., str]]] = {
    "log.csv": ("t_s,range_m,az_deg,el_deg\n", "{:.2f},{:.2f},{:.4f},{:.4f}".format),
    "semicolons.csv": ("t_s;range_m;az_deg;el_deg\n", "{:.2f};{:.2f};{:.4f};{:.4f}".format),
    "blanks.txt": ("t_s range_m az_deg el_deg\n", "{:9.2f} {:9.2f} {:9.4f} {:9.4f}".format),
    "whole.csv": ("t_s,el_deg,az_deg,range_mm\n", lambda t, r, a, e: f"{t:.2f},{e:.4f},{a:.4f},{1e3 * r:.0f}"),
    "pairs.log": ("", "t={:.2f} R_m={:.2f} AZ_deg={:.4f} EL_deg={:.4f}".format),
    "log.jsonl": ("", '{{"t_s": {:.2f}, "range_m": {:.2f}, "az_deg": {:.4f}, "el_deg": {:.4f}}}'.format),
}


@pytest.mark.parametrize("name", WRITTEN)
def test_a_line_that_is_cut_off_is_left_out_and_said(make: Make, name: str) -> None:
    head, row = WRITTEN[name]
    whole = head + "\n".join(row(*each) for each in ROWS)
    assert len(logs.read(make(whole, name))) == len(ROWS)
    for gone in (1, 2, 3, 8, 12, 20):
        log = logs.read(make(whole[:-gone], name))
        assert len(log) == len(ROWS) - 1, whole[-30:-gone]
        assert abs(log.measurement[-1, 0] - FLIGHT.r[-2]) < 0.01
        last = whole[:-gone].rpartition("\n")[2]
        assert any("the last line, " in note and last.strip() in note for note in log.remarks)


def test_a_large_file_too(make: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    head, row = WRITTEN["log.csv"]
    whole = head + "\n".join(row(*each) for each in ROWS)
    monkeypatch.setattr(content, "LARGE", 1000)
    monkeypatch.setattr(csvtext, "_HEAD", 2000)
    monkeypatch.setattr(blocks, "_BLOCK", 500)
    log = logs.read(make(whole[:-2]))
    assert len(log) == len(ROWS) - 1
    assert 'the last line, "' in " ".join(log.remarks)


def test_digits_that_differ_from_row_to_row_say_nothing(make: Make) -> None:
    """The last number of many has fewer digits than the others in a few of them."""
    text = "t,R,E\n" + "\n".join(f"{k},{1000 + k},{digits}" for k, digits in enumerate([0.25, 0.5, 0.125, 0.375, 1]))
    assert len(logs.read(make(text))) == 5
