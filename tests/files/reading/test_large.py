"""A file read in blocks gives the same log as one read at once; faults that need the whole file are found at once."""

from __future__ import annotations

import errno
import os
import tempfile
from dataclasses import fields

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from ftproc.errors import InputError
from ftproc.files.reading import large, logs
from ftproc.files.reading.formats import blocks, content, csvtext
from ftproc.files.reading.formats.columnar import parquet as columnar
from ftproc.settings import Air, Station

ROWS = 3000


@pytest.fixture
def in_blocks(monkeypatch):
    """Every file counts as large."""
    monkeypatch.setattr(content, "LARGE", 100)
    monkeypatch.setattr(csvtext, "_HEAD", 2000)
    monkeypatch.setattr(columnar, "_BATCH_ROWS", 700)
    monkeypatch.setattr(blocks, "_BLOCK", 20_000)


def columns(rows=ROWS):
    rng = np.random.default_rng(3)
    t = 10.0 + 0.1 * np.arange(rows)
    return {
        "time_s": t,
        "range_m": 9000 + t,
        "azimuth_deg": 200 * rng.random(rows),
        "elevation_deg": 9 + rng.random(rows),
    }


def text(table, special=None):
    lines = [",".join(table)]
    for k, cells in enumerate(zip(*table.values(), strict=True)):
        lines.append((special or {}).get(k) or ",".join(f"{c!r}" if isinstance(c, str) else f"{c:.9g}" for c in cells))
    return "\n".join(lines) + "\n"


def same(one, other):
    for field in fields(one):
        left, right = getattr(one, field.name), getattr(other, field.name)
        if isinstance(left, np.ndarray):
            np.testing.assert_array_equal(left, right, err_msg=field.name)
        else:
            assert left == right, field.name


def both(path, monkeypatch, **how):
    """The log read in blocks, and at once."""
    cut = logs.read(path, **how)
    assert isinstance(cut.time_s, np.memmap)
    monkeypatch.setattr(content, "LARGE", 1 << 40)
    return cut, logs.read(path, **how)


@pytest.mark.parametrize("kind", ["csv", "parquet"])
@pytest.mark.parametrize(
    "station",
    [Station(), Station("north", "anticlockwise", 0.3, "zenith", (5.0, 1e-3, 0.0), 2.5)],
    ids=["plain", "station"],
)
def test_blocks_are_the_whole(tmp_path, in_blocks, monkeypatch, kind, station):
    path, table = tmp_path / f"log.{kind}", columns()
    if kind == "csv":
        path.write_text(text(table))
    else:
        pq.write_table(pa.table(table), path)
    same(*both(path, monkeypatch, station=station))


def test_missing_cells_empty_lines_and_rows_without_time(tmp_path, in_blocks, monkeypatch):
    special = {5: "10.5,,3,4", 900: "100,9100,,", 901: ",9000,1,1", 2000: "\n210,9210,1,1", 2500: "260,nan,NA,5"}
    path = tmp_path / "log.csv"
    path.write_text(text(columns(), special))
    cut, whole = both(path, monkeypatch)
    same(cut, whole)
    assert cut.rows_without_time == (901,)
    assert cut.rows_in_file == ROWS
    assert 901 not in cut.row


def test_timestamps_over_midnight(tmp_path, in_blocks, monkeypatch):
    stamps = np.datetime64("2024-05-31T23:59:00.0") + np.arange(ROWS) * np.timedelta64(100, "ms")
    table = {"time": [str(s) + "Z" for s in stamps], **{k: v for k, v in columns().items() if k != "time_s"}}
    path = tmp_path / "log.csv"
    path.write_text(text(table).replace("'", ""))
    cut, whole = both(path, monkeypatch)
    same(cut, whole)
    assert cut.epoch == "2024-05-31T00:00:00Z"
    assert cut.time_s[-1] > 86400


@pytest.mark.parametrize(
    ("special", "said"),
    [
        (
            {2800: "290,9290,north,5"},
            'row 2800 (the first data row is 0), column "azimuth_deg": "north" is not a number',
        ),
        ({2800: "290,9290,5"}, "row 2800 (the first data row is 0) has 3 cells"),
        ({2800: '290,9290,"5,6'}, "quotation mark"),
        ({2800: "290,inf,5,6"}, 'row 2800 (the first data row is 0), column "range_m": "inf" is not finite'),
    ],
)
def test_what_is_wrong_is_named_by_its_row(tmp_path, in_blocks, special, said):
    path = tmp_path / "log.csv"
    path.write_text(text(columns(), special))
    with pytest.raises(InputError) as error:
        logs.read(path)
    assert said in str(error.value)


def test_rows_out_of_order_are_sorted_at_once(tmp_path, in_blocks):
    path = tmp_path / "log.csv"
    path.write_text(text(columns(), {2800: "12.05,9002,5,6"}))
    log = logs.read(path)
    assert log.rows_out_of_order == 1
    assert not isinstance(log.time_s, np.memmap)


def test_unit_is_judged_by_the_whole(tmp_path, in_blocks):
    table = columns()
    table["azimuth_rad"] = table.pop("azimuth_deg")
    path = tmp_path / "log.csv"
    path.write_text(text(table))
    with pytest.raises(InputError, match="Say --columns azimuth=azimuth_rad --units azimuth=deg"):
        logs.read(path)


def test_damaged_parquet_is_refused(tmp_path, in_blocks):
    path = tmp_path / "log.parquet"
    pq.write_table(pa.table(columns()), path)
    data = bytearray(path.read_bytes())
    data[3000:3400] = bytes(400)
    path.write_bytes(data)
    with pytest.raises(InputError, match="damaged"):
        logs.read(path)


def test_no_room_for_temporary_files_is_refused(tmp_path, in_blocks, monkeypatch):
    path = tmp_path / "log.csv"
    path.write_text(text(columns()))

    def full(*args):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(large._Spool, "add", full)
    with pytest.raises(InputError, match="TMPDIR") as error:
        logs.read(path)
    assert tempfile.gettempdir() in str(error.value)


def test_file_that_only_says_it_is_large(tmp_path, in_blocks):
    path = tmp_path / "log.csv"
    path.write_text(",".join(columns()) + "\n" * 3000)
    with pytest.raises(InputError, match="no rows"):
        logs.read(path)


def test_no_reading_at_all_is_refused(tmp_path, in_blocks):
    path = tmp_path / "log.csv"
    path.write_text(text(columns(), {k: f"{k},,," for k in range(ROWS)}))
    with pytest.raises(InputError, match="no row has a range, azimuth or elevation"):
        logs.read(path)


def test_text_in_parquet_that_is_not_utf_8_is_refused(tmp_path, in_blocks):
    table = columns()
    table["azimuth_deg"] = pa.array([b"\x81"] * ROWS).view(pa.string())
    path = tmp_path / "log.parquet"
    pq.write_table(pa.table(table), path)
    with pytest.raises(InputError, match="damaged"):
        logs.read(path)


def test_doubts_do_not_rest_on_rows_without_time(tmp_path, in_blocks, monkeypatch):
    path = tmp_path / "log.csv"
    path.write_text(text(columns(), dict.fromkeys(range(0, ROWS, 2), ",9000,5,85") | {1: "10.1,9000,5,85"}))
    cut, whole = both(path, monkeypatch)
    same(cut, whole)
    assert not cut.remarks


def test_ray_is_bent_by_the_distance_read_far_away(tmp_path, in_blocks, monkeypatch):
    """A long stretch without ranges lies between two that have them, blocks away."""
    path = tmp_path / "log.csv"
    path.write_text(text(columns(), {k: f"{10 + 0.1 * k:.9g},,5,5" for k in range(1000, 2500)}))
    station = Station(refraction=Air())
    log = logs.read(path, station=station)
    monkeypatch.setattr(content, "LARGE", 1 << 40)
    same(log, logs.read(path, station=station))


@pytest.mark.parametrize("first", [True, False])
def test_decimal_commas_anywhere_tell_what_a_point_means(tmp_path, in_blocks, monkeypatch, first):
    monkeypatch.setattr(blocks, "_BLOCK", 64)
    lines = text(columns(40)).replace(",", ";").splitlines()
    half = [line if (k < 20) == first else line.replace(".", ",") for k, line in enumerate(lines[1:])]
    path = tmp_path / "log.csv"
    path.write_text("\n".join([lines[0], *half[:20], *[""] * 200, *half[20:]]) + "\n")  # no block has both
    with pytest.raises(InputError, match="is not a number"):
        logs.read(path)


def test_decimal_commas_are_read_in_blocks(tmp_path, in_blocks, monkeypatch):
    path = tmp_path / "log.csv"
    path.write_text(text(columns()).replace(",", ";").replace(".", ","))
    same(*both(path, monkeypatch))


def test_rows_that_a_parquet_file_claims_but_lacks_are_missed(tmp_path, in_blocks, monkeypatch):
    path = tmp_path / "log.parquet"
    pq.write_table(pa.table(columns()), path)
    whole, batches = pq.ParquetFile.read, pq.ParquetFile.iter_batches
    monkeypatch.setattr(pq.ParquetFile, "read", lambda *args, **how: whole(*args, **how).slice(0, 2900))
    with pytest.raises(InputError, match="2900 rows where it says 3000"):
        logs.read(path, keep_columns=True, columns={"elevation": "none"})  # as a whole, for the column that is kept
    monkeypatch.setattr(pq.ParquetFile, "iter_batches", lambda *args, **how: list(batches(*args, **how))[:-1])
    with pytest.raises(InputError, match="2900 rows where it says 3000"):
        logs.read(path)  # in blocks, and then as a whole


def changed(path, how):
    """What another program does to a log that is being read."""
    content_before = path.read_bytes()
    if how == "shorter":
        os.truncate(path, len(content_before) // 2)
    elif how == "cut in a row":
        os.truncate(path, len(content_before) // 2 + 7)
    elif how == "empty":
        os.truncate(path, 0)
    elif how == "rewritten":
        path.write_bytes(content_before.replace(b"9", b"8"))
        os.utime(path, (0, 0))
    elif how == "replaced":
        other = path.with_name("other")
        other.write_bytes(content_before)
        other.replace(path)
    else:
        path.write_bytes(content_before + content_before.splitlines(keepends=True)[-1])


@pytest.mark.parametrize("how", ["shorter", "cut in a row", "empty", "rewritten"])
@pytest.mark.parametrize("large_file", [True, False])
def test_a_log_that_changes_while_it_is_read_is_refused(tmp_path, monkeypatch, request, how, large_file):
    path = tmp_path / "log.csv"
    path.write_text(text(columns()))
    if large_file:
        request.getfixturevalue("in_blocks")
        add = large._Spool.add
        monkeypatch.setattr(large._Spool, "add", lambda *block: (add(*block), changed(path, how)))
    else:
        stat = os.fstat
        looked = []

        def fstat(descriptor):
            found = stat(descriptor)
            looked.append(descriptor)
            if len(looked) == 3:  # the header's two looks are over; the file is open and about to be read
                changed(path, how)
            return found

        monkeypatch.setattr(content.os, "fstat", fstat)
    with pytest.raises(InputError, match=r"log\.csv: the file (changed while it was read; wait|is empty)"):
        logs.read(path)


@pytest.mark.parametrize(("how", "rows"), [("replaced", None), ("longer", ROWS)])
def test_a_log_that_is_replaced_or_grows(tmp_path, monkeypatch, in_blocks, how, rows):
    path = tmp_path / "log.csv"
    path.write_text(text(columns()))
    before = blocks.of_file
    monkeypatch.setattr(blocks, "of_file", lambda *given: (changed(path, how), *before(*given))[1:])
    if rows is None:
        with pytest.raises(InputError, match=r"log\.csv: the file changed while it was read"):
            logs.read(path)
    else:
        assert len(logs.read(path)) >= rows
