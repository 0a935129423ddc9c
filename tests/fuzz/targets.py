"""What is fuzzed: a target takes the bytes of a file and raises for whatever is neither a result nor a plain sentence.

Two drivers feed them: `mutation` (plain Python, a little of it in every `make test`) and `python -m tests.fuzz`
(coverage-guided, `make fuzz`). What the latter found worth keeping lies in `corpus/` and is replayed by the tests.
"""

from __future__ import annotations

import contextlib
import io
import json
import tempfile
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import pyarrow as pa
from safetensors.numpy import save as serialise

from ftproc import pipeline
from ftproc.config import reading, writing
from ftproc.config.recipe import Recipe
from ftproc.correction import model, model_file
from ftproc.errors import FtprocError
from ftproc.files import layout
from ftproc.files.reading import logs, trajectories, truth
from ftproc.files.reading.formats import blocks, content
from ftproc.files.reading.formats.columnar import parquet as columnar
from ftproc.files.writing import flights
from ftproc.files.writing.trajectories import write as write_trajectory
from ftproc.records import MeasurementLog
from tests.fuzz import kernel
from tests.trust import bad_files, bad_logs, bad_models, bad_stations, bad_times, bad_truths, cases

_LONGEST_NAME = 100
_LARGEST_SEED = 30_000  # bytes; from small inputs a fuzzer learns faster


@dataclass(frozen=True)
class Target:
    """check: reads the file at a path, raising FtprocError to refuse it, anything else when the product is wrong.

    suffix: of the file's name. tables: of the corpus of bad files, whose small cases of this kind and suffix are where
    a fuzzer starts; with what `more` gives.
    """

    suffix: str
    kind: str
    check: Callable[[Path], None]
    tables: tuple[Callable[[], Iterator[cases.Case]], ...] = ()
    more: Callable[[], Iterator[bytes]] = lambda: iter(())


def judge(target: Target, content: bytes, directory: Path) -> None:
    """One input. Warnings count as wrong; a refusal must be one plain sentence that names the file."""
    path = directory / f"f{target.suffix}"
    path.write_bytes(content)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            target.check(path)
    except FtprocError as error:
        cases.judge_sentence(path.name, str(error))


def seeds(target: Target) -> list[bytes]:
    """Small files to begin with, good and bad."""
    found = [_small_files(table) for table in target.tables]
    bad = [content for files in found for kind, name, content in files
           if kind == target.kind and name.endswith(target.suffix)]  # fmt: skip
    return [*target.more(), *bad]


@cache
def _small_files(table: Callable[[], Iterator[cases.Case]]) -> list[tuple[str, str, bytes]]:
    """Kind, name and content of each case that is a small file."""
    found = []
    for case in table():
        with tempfile.TemporaryDirectory() as directory:
            path = case.make(Path(directory))
            if len(path.name) < _LONGEST_NAME and path.is_file() and path.stat().st_size <= _LARGEST_SEED:
                found.append((case.kind, path.name, path.read_bytes()))
    return found


def _log(path: Path) -> None:
    """What can be read comes back bit for bit when it was written; keeping the other columns changes no number."""
    _in_blocks(path)
    log = logs.read(path)
    assert len(log) > 0
    assert np.isfinite(log.time_s).all()
    assert (log.time_s[1:] >= log.time_s[:-1]).all()
    assert not np.isinf(log.measurement).any()
    again = path.with_name("again.parquet")
    flights.write_log(log, again)
    if log.rows_out_of_order:  # by which numbers that mean missing ones may be told otherwise
        return
    with contextlib.suppress(FtprocError):  # rows without a time are gone, by which the unit of an angle may be judged
        same(logs.read(again), log, "time_s", "measurement")
    same(logs.read(path, keep_columns=True), log, "time_s", "measurement")


_CHECKED = ("time_s", "measurement", "row", "rows_in_file", "rows_without_time", "rows_out_of_order",
            "duplicate_times", "epoch", "frame", "remarks")  # fmt: skip


def _in_blocks(path: Path) -> None:
    """A log is the same, and refused in the same words, whether it is read as a whole or as a large one is."""
    whole = _read_or_refused(path)
    large, small = mock.patch.object(content, "LARGE", 0), mock.patch.object(columnar, "_BATCH_ROWS", 3)
    with large, small, mock.patch.object(blocks, "_BLOCK", 64):
        in_blocks = _read_or_refused(path)
    if isinstance(whole, str) or isinstance(in_blocks, str):
        assert in_blocks == whole
    else:
        same(in_blocks, whole, *_CHECKED)


def _read_or_refused(path: Path) -> MeasurementLog | str:
    try:
        return logs.read(path)
    except FtprocError as error:
        return str(error)


def _truth(path: Path) -> None:
    found = truth.read(path)
    again = path.with_name("again.parquet")
    flights.write_truth(found, again)
    same(truth.read(again), found, "time_s", "position_m", "velocity_mps", "outlier")


def _trajectory(path: Path) -> None:
    found = trajectories.read(path)
    again = path.with_name("again.parquet")
    write_trajectory(found, again)
    same(trajectories.read(again), found, "row", "time_s", "measurement", "state", "sigma", "outlier", "nis")


def same(found: Any, expected: Any, *names: str) -> None:
    """AssertionError unless these attributes of two records are equal, NaN and all."""
    for name in names:
        a, b = getattr(found, name), getattr(expected, name)
        equal = np.array_equal(a, b, equal_nan=True) if isinstance(a, np.ndarray) else a == b
        assert equal, f"{name} does not come back"


def _station(path: Path) -> None:
    """What is understood can be written, and then says the same."""
    options = reading.load(path)
    Recipe.of(options)
    again = reading.parse(writing.dump(options), path.name)
    if "model" in options:
        again["model"] = options["model"]  # written with its whole path
    Recipe.of(again)


def _model(path: Path) -> None:
    _sound(model_file.load(path))


def _header(path: Path) -> None:
    """The text is what a model says of itself, around the tensors of the packaged one."""
    text = path.read_bytes().decode("utf-8", "replace")
    content = bytes(serialise(bad_models.parts()[0], metadata={bad_models.KEY: text}))
    _sound(model_file.from_bytes(content, path.name))


def _sound(found: model.Model) -> None:
    """It comes back bit for bit, can be described, and does no harm to a flight."""
    content = model_file.to_bytes(found)
    assert model_file.to_bytes(model_file.from_bytes(content, "again")) == content
    model.card(found)
    with contextlib.suppress(FtprocError):  # trained for another method
        cases.judge_trajectory(pipeline.filter_log(cases.flight().log, None, found))


def _headers() -> Iterator[bytes]:
    whole = bad_models.parts()[1]
    yield json.dumps(whole).encode()
    for stage in whole["stages"].values():
        stage["verdict"] = None
    yield json.dumps(whole).encode()


def _parquets() -> Iterator[bytes]:
    few = {name: column[:5] for name, column in bad_files.columns().items()}
    yield bad_files.packed(few, write_page_checksum=True)
    yield bad_files.packed(few, compression="none", use_dictionary=False, write_statistics=False)


def _feathers() -> Iterator[bytes]:
    few = {name: column[:5] for name, column in bad_files.columns(note=np.full(40, "a")).items()}
    for codec in (None, "lz4", "zstd"):
        sink = pa.BufferOutputStream()
        table = pa.table(few)
        with pa.ipc.new_file(sink, table.schema, options=pa.ipc.IpcWriteOptions(compression=codec)) as stream:
            stream.write_table(table, max_chunksize=3)
        yield sink.getvalue().to_pybytes()


def _trajectories() -> Iterator[bytes]:
    for line in (",".join(layout.TRAJECTORY), "time_s,x_m,y_m,z_m,outlier_range,nis,note"):
        yield (line + "\n" + "\n".join(",".join("1" for _ in line.split(",")) for _ in range(3)) + "\n").encode()


def _names(path: Path) -> None:
    """The bytes are the line of names above the flight's rows, with or without units in a row of their own."""
    line = path.read_bytes().replace(b"\n", b" ").replace(b"\r", b" ")
    made = path.with_name(f"{path.stem}.csv")
    width = line.count(b",") + 1
    rows = [",".join((row * width)[:width]) for row in cases.rows()]
    made.write_bytes(line + b"\n" + "\n".join(rows).encode() + b"\n")
    try:
        assert len(logs.read(made)) > 0
    except FtprocError as error:
        cases.judge_sentence(made.name, str(error))


def _lines_of_names() -> Iterator[bytes]:
    for line in (
        "Time (s),Range [km],Az °,El (0.1 mrad)", "gps_week,TOW,slantRange/yd,AZ in mil,EL", "t,R,theta,phi",
        "CAT048.I140.ToD,CAT048.I040.RHO.val,CAT048.I040.THETA.val", "1: utc,2: rng (x100 ft),3: az_deg,4: zenith",
        "Uhrzeit,Schrägentfernung (m),Azimut (gon),Höhenwinkel (gon)", "date,time,dist in 1/128 nmi,bearing,elev",
    ):  # fmt: skip
        yield line.encode()


def _arrays(kind: str) -> Callable[[], Iterator[bytes]]:
    """Small files of arrays of one kind."""

    def made() -> Iterator[bytes]:
        few = {name: column[:5] for name, column in bad_files.columns().items()}
        for sink, write in ((io.BytesIO(), write) for write in _WRITERS[kind]):
            write(sink, few)
            yield sink.getvalue()

    return made


def _hdf5(sink: Any, few: dict[str, Any], compound: bool = False) -> None:
    import h5py

    with h5py.File(sink, "w", libver="latest" if compound else None) as out:
        if compound:
            out["log"] = np.rec.fromarrays(list(few.values()), names=list(few))
        for name, column in few.items() if not compound else ():
            out.create_dataset(name, data=column, chunks=(5,), compression="gzip").attrs["units"] = "m"


def _netcdf(sink: Any, few: dict[str, Any]) -> None:
    from scipy.io import netcdf_file

    held = io.BytesIO()  # which is closed with the file
    out = netcdf_file(held, "w")
    out.createDimension("n", 5)
    for name, column in few.items():
        made = out.createVariable(name, "f8", ("n",))
        made[:] = column
        made.units = name.rpartition("_")[2]
    out.flush()
    sink.write(held.getvalue())


def _savemat(sink: Any, few: dict[str, Any], whole: bool, packed: bool) -> None:
    from scipy.io import savemat

    rows = np.array([dict(zip(few, row, strict=True)) for row in zip(*few.values(), strict=True)], object)
    savemat(sink, few if whole else {"log": rows}, do_compression=packed)


_WRITERS: dict[str, tuple[Callable[[Any, dict[str, Any]], None], ...]] = {
    "h5": (_hdf5, lambda sink, few: _hdf5(sink, few, True)),
    "nc": (_netcdf, _netcdf),
    "mat": tuple(lambda sink, few, w=w, p=p: _savemat(sink, few, w, p) for w in (True, False) for p in (True, False)),
    "npz": (lambda sink, few: np.savez(sink, **few), lambda sink, few: np.savez_compressed(sink, **few)),
}


def _documents() -> Iterator[bytes]:
    few = {name: column[:5].tolist() for name, column in bad_files.columns().items()}
    rows = [dict(zip(few, row, strict=True)) for row in zip(*few.values(), strict=True)]
    plain = {"columns": list(few), "data": [list(row.values()) for row in rows]}
    for document in (few, rows, {"station": "a", "polar": rows}, plain):
        yield json.dumps(document).encode()
    yield "\n".join(json.dumps({"t": {"value": row["time_s"]}, **row}) for row in rows).encode()


_TEXTS = (bad_logs.all_cases, bad_times.all_cases, bad_files.all_cases)


@cache
def all_targets() -> dict[str, Target]:
    """By the names that `make fuzz` has for them."""
    return {
        "csv": Target(".csv", "log", _log, _TEXTS),
        "gzip": Target(".csv.gz", "log", _log, _TEXTS),
        "parquet": Target(".parquet", "log", _log, (bad_files.all_cases,), _parquets),
        "feather": Target(".feather", "log", _log, (bad_files.all_cases,), _feathers),
        "truth": Target(".csv", "truth", _truth, (bad_truths.all_cases,)),
        "trajectory": Target(".csv", "trajectory", _trajectory, (), _trajectories),
        "station": Target(".toml", "station", _station, (bad_stations.all_cases,)),
        "model": Target(".safetensors", "model", _model, (bad_models.all_cases,)),
        "header": Target(".json", "header", _header, (), _headers),
        **{kind: Target(f".{kind}", "log", _log, (), _arrays(kind)) for kind in _WRITERS},
        "json": Target(".json", "log", _log, (), _documents),
        "names": Target(".txt", "names", _names, (), _lines_of_names),
        "kernel": Target(".bin", "readings", kernel.check, (), kernel.seeds),
    }
