"""What is too large, too long, elsewhere or odd: the sentences, and what is read all the same."""

from __future__ import annotations

import gzip
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from ftproc.errors import InputError
from ftproc.files import limits, remote
from ftproc.files.reading import logs, trajectories
from ftproc.files.reading.formats import tables
from ftproc.files.reading.formats.arrays import rehearsal
from ftproc.files.reading.formats.columnar import sizes
from ftproc.files.reading.formats.sparse import Sparse
from ftproc.files.reading.meaning.names import taken_apart
from tests.files.conftest import Make, refused

N = 40
T = np.arange(N) * 0.5
COLUMNS = {"time_s": T, "range_m": 5000 + 40 * T, "azimuth_rad": 0.3 + 0.001 * T, "elevation_rad": 0.2 + 0.0005 * T}
BOMB = "bytes unpack to more than 64 MiB, which no log does. If it is one, unpack it first"


def stored(path: Path, fill: Callable[[Any], object] = lambda out: None, without: str = "") -> Path:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as out:
        for name, values in COLUMNS.items():
            if name != without:
                out[name] = values
        fill(out)
    return path


def test_the_room_of_a_file() -> None:
    small, large = limits.Room("a.csv", 10), limits.Room("b.csv", 10 << 20)
    small.check(64 << 20)
    small.check(0, (64 << 20) // limits.ROW)
    large.check(1000 << 20)
    for room, size, rows in ((small, (64 << 20) + 1, 0), (small, 0, 200_000), (large, (1000 << 20) + 1, 0)):
        with pytest.raises(InputError, match=rf"{room.name}: these {room.packed} bytes unpack to more than"):
            room.check(size, rows)


def test_archives_in_archives_have_one_room(make: Make) -> None:
    whole = gzip.compress(gzip.compress(bytes(70 << 20)))
    assert BOMB in refused(make(whole, "log.csv.gz.gz"))
    rows = b"time_s,range_m,azimuth_rad,elevation_rad\n" + b"1,5000,1,1\n" * 200_000
    assert BOMB in refused(make(gzip.compress(rows), "log.csv.gz"))


def test_names_and_columns(make: Make) -> None:
    text = f"time_s,range_m,{'x' * 1001}\n0,1,2\n"
    assert "the name of column 3 has more than 1000 characters; write a line of column names." in refused(make(text))
    for wide in (",".join(f"c{k}" for k in range(5001)) + "\n" + ",".join("1" * 5001), "," * 2_000_000):
        assert "it has more than 5000 columns, which no log has" in refused(make(wide + "\n"))
    assert taken_apart("R" * 1001).stem == ""
    assert taken_apart("Range\n(km)").unit == "km"
    assert taken_apart("Range in x 100 m").unit == "x 100 m"


def test_rows_without_columns_take_no_memory() -> None:
    rows = Sparse(limits.Room("a.json", 100))
    for row in range(1000):
        rows.add([("time_s", row), ("time_s", -1)] if row else [("time_s", 0), ("a", "x"), ("b\ud800", 2**70)])
    assert rows.cells == 1002
    header = rows.header("JSON objects")
    assert header.names == ["time_s", "a", "b\\ud800"]
    table = header.load([0], [1, 2])
    assert table.column(0).to_pylist() == list(range(1000))
    assert table.column(1).to_pylist()[:2] == ["x", None]
    assert table.column(2).to_pylist()[0] == str(2**70)
    with pytest.raises(InputError, match="more than 5000 columns"):
        rows.add((str(k), k) for k in range(5000))


def test_numbers_and_letters_of_json(make: Make) -> None:
    rows = [dict(zip(COLUMNS, map(float, row), strict=True)) for row in zip(*COLUMNS.values(), strict=True)]
    text = "\n".join(json.dumps(row) for row in rows)
    long = text.replace('"range_m": 5000.0', f'"range_m": {"9" * 5000}')
    assert 'row 0 (the first data row is 0), column "range_m": "inf" is not finite' in refused(make(long, "a.jsonl"))
    noted = text.replace('"time_s": 0.0', '"note": "\\ud800", "\\udfff": 1, "time_s": 0.0')
    log = logs.read(make(noted, "b.jsonl"), keep_columns=True)
    assert log.extra.column("note").to_pylist()[:2] == ["\\ud800", None]
    wide = text + "\n" + json.dumps({"time_s": 99.0, "range_m": 5000.0} | {f"k{k}": k for k in range(4900)})
    assert len(logs.read(make(wide, "c.jsonl"))) == N + 1


@pytest.mark.parametrize("dictionary", [True, False])
def test_a_long_word_in_many_rows_of_parquet(tmp_path: Path, dictionary: bool) -> None:
    table = pa.table({name: np.resize(values, 1000) for name, values in COLUMNS.items() if name != "time_s"})
    words = pa.array(["x" * 100_000] * 1000)
    path = tmp_path / "log.parquet"
    pq.write_table(table.append_column("time", words), path, use_dictionary=dictionary, compression="zstd")
    assert BOMB in refused(path)
    assert BOMB in refused(path, keep_columns=True)


def test_what_arrow_unpacks_to(tmp_path: Path) -> None:
    words = pa.DictionaryArray.from_arrays(pa.array([0, 0, 1, None]), pa.array(["abc", "de"]))
    assert sizes.unpacked(pa.chunked_array([words])) == 8
    table = pa.table(COLUMNS | {"note": pa.array(["z" * 4_000_000] * N)})
    for new, name in ((pa.ipc.new_file, "a.arrow"), (pa.ipc.new_stream, "b.arrow")):
        for codec in ("zstd", "lz4"):
            with new(tmp_path / name, table.schema, options=pa.ipc.IpcWriteOptions(compression=codec)) as out:
                out.write_table(table)
            claim = max(sizes.claims((tmp_path / name).read_bytes()))
            assert claim.rows == N
            assert 160e6 < claim.size < 161e6
            assert BOMB in refused(tmp_path / name)


def test_only_the_columns_that_are_needed_are_read(tmp_path: Path) -> None:
    path = stored(tmp_path / "a.h5", lambda out: out.create_dataset("more", (N,), "S9000000"))
    assert len(logs.read(path)) == N
    assert BOMB in refused(path, keep_columns=True)
    nowhere = stored(tmp_path / "b.h5", lambda out: out.create_group("g").create_dataset("x", (10**9, 4), "f8"))
    assert BOMB in refused(f"{nowhere}#g")


def test_hdf5_stays_in_its_file(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    stored(tmp_path / "other.h5")
    (tmp_path / "raw").write_bytes(bytes(8 * N))

    def virtual(out: Any) -> None:
        layout = h5py.VirtualLayout((N,), "f8")
        layout[:] = h5py.VirtualSource("other.h5", "range_m", (N,))
        out.create_virtual_dataset("range_m", layout)

    def through(out: Any) -> None:
        out["away"], out["range_m"] = h5py.ExternalLink("other.h5", "/"), h5py.SoftLink("/away/range_m")

    for fill, said in (
        (
            lambda out: out.__setitem__("range_m", h5py.ExternalLink("other.h5", "/range_m")),
            '"/range_m" lies in another',
        ),
        (
            lambda out: out.create_dataset("range_m", (N,), "f8", external=[("raw", 0, 8 * N)]),
            '"/range_m" keeps its values',
        ),
        (virtual, '"/range_m" is a virtual dataset of other files'),
        (through, '"/away" lies in another file, other.h5'),
    ):
        sentence = refused(stored(tmp_path / "a.h5", fill, "range_m"))
        assert said in sentence
        assert "which is not read, because a log must lie in its own file" in sentence


def test_one_odd_dataset_does_not_damage_a_file(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    for fill in (
        lambda out: out.create_dataset("odd", data=h5py.Empty("f8")),
        lambda out: out.create_dataset("odd", (N,), "V7"),
        lambda out: out.create_dataset("odd", (N,), h5py.ref_dtype),
        lambda out: out.__setitem__("odd", np.dtype([("a", "f8")])),
        lambda out: out.__setitem__("odd", h5py.SoftLink("/nothing")),
        lambda out: out["range_m"].attrs.__setitem__("units", 5.0),
    ):
        log = logs.read(stored(tmp_path / "a.h5", fill))
        np.testing.assert_array_equal(log.measurement[:, 0], COLUMNS["range_m"])
    latin = stored(tmp_path / "a.h5", lambda out: out.__setitem__(b"rang\xe5_m", COLUMNS["range_m"]), "range_m")
    assert tables.read_header(latin).names == ["azimuth_rad", "elevation_rad", "rang\ufffd_m", "time_s"]


def test_structures_of_matlab(tmp_path: Path) -> None:
    from scipy.io import savemat

    rows = [dict(zip(COLUMNS, row, strict=True)) | {"parts": [1.0] * (k % 3)}
            for k, row in enumerate(zip(*COLUMNS.values(), strict=True))]  # fmt: skip
    rows[3]["range_m"] = []
    savemat(tmp_path / "a.mat", {"log": np.array(rows, object)})
    found = logs.read(tmp_path / "a.mat").measurement[:, 0]
    assert np.isnan(found[3])
    np.testing.assert_array_equal(np.delete(found, 3), np.delete(COLUMNS["range_m"], 3))
    savemat(tmp_path / "b.mat", COLUMNS | {"more": np.zeros(9_000_000)}, do_compression=True)
    assert BOMB in refused(tmp_path / "b.mat")


def test_arrays_of_numpy(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", **{name: values.astype(np.longdouble) for name, values in COLUMNS.items()})
    np.testing.assert_array_equal(logs.read(tmp_path / "a.npz").measurement[:, 0], COLUMNS["range_m"])
    np.savez(tmp_path / "b.npz", **COLUMNS, odd=np.array([{}] * N, object))
    assert len(logs.read(tmp_path / "b.npz")) == N
    np.savez_compressed(tmp_path / "c.npz", **COLUMNS, more=np.zeros(9_000_000))
    assert BOMB in refused(tmp_path / "c.npz")


def test_days_that_no_calendar_has(make: Make) -> None:
    rest = "range_m,azimuth_rad,elevation_rad\n"
    for head, cell, said in (
        ("jd", "1e300", 'column "jd": "1e+300 days" is not within the years 1 to 9999'),
        ("gps_week,tow", "1e18,5", 'column "gps_week + tow": "7e+18 days" is not within the years 1 to 9999'),
        ("year,doy,sod", "1e18,1,5", 'column "year + doy + sod": "1000000000000000000-1" is not a date'),
    ):
        assert said in refused(make(f"{head},{rest}" + "".join(f"{cell},{5000 + k},1,1\n" for k in range(9))))
    assert 'column "range_km": "inf" is not finite' in refused(make("time_s,range_km,A,E\n0,1e308,1,1\n1,5,1,1\n"))


def test_files_that_come_out_of_an_archive_by_their_address(tmp_path: Path, make: Make) -> None:
    pytest.importorskip("fsspec")
    import zipfile

    with zipfile.ZipFile(tmp_path / "a.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a.csv", bytes(70 << 20))
    for address in (f"zip://a.csv::{tmp_path}/a.zip", f"zip://a.csv::file://{tmp_path}/a.zip"):
        assert BOMB in refused(address)
    assert "not an ordinary file" in refused("local:///dev/zero")
    assert remote.local("local:///tmp/a.csv") == Path("/tmp/a.csv")
    assert remote.local("zip://a.csv::file:///tmp/a.zip") is None


def test_a_pipe_for_a_sidecar_does_not_hold(tmp_path: Path) -> None:
    import os

    path = tmp_path / "a.csv"
    path.write_text("time_s,x_m,y_m,z_m\n0,1,2,3\n1,2,3,4\n")
    os.mkfifo(tmp_path / "a.json")
    assert trajectories.read(path).metadata == {}


def test_a_library_that_does_not_come_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Reading is rehearsed in a process of its own: its end is not ours, and it is not waited for without an end."""
    import os
    import signal
    import time

    path = tmp_path / "a.h5"
    path.write_bytes(b"1")
    monkeypatch.setattr(rehearsal, "_LONGEST_S", 0.2)
    copies, fork = list[int](), os.fork

    def counted() -> int:
        copies.append(fork())
        return copies[-1]

    monkeypatch.setattr(os, "fork", counted)

    def fails() -> None:
        raise ValueError("comes again in the reader")

    def rehearsed(read: Callable[[], object]) -> str:
        with pytest.raises(InputError) as caught:
            rehearsal.rehearse(path, "a.h5", "an HDF5 file", read)
        return str(caught.value)

    rehearsal.rehearse(path, "a.h5", "an HDF5 file", lambda: None)
    rehearsal.rehearse(path, "a.h5", "an HDF5 file", fails)
    sentence = "a.h5: not an HDF5 file, or a damaged one ({}); copy it again."
    assert rehearsed(lambda: os.kill(os.getpid(), signal.SIGSEGV)) == sentence.format("its reader ends with -11")
    assert rehearsed(lambda: time.sleep(60)) == sentence.format("it comes to no end")
    assert len(copies) == 4
    for copy in copies:  # none is left behind
        with pytest.raises(ChildProcessError):
            os.waitpid(copy, os.WNOHANG)
