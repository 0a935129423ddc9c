"""Attacks on the reader of HDF5: values that are nowhere, or elsewhere."""

from __future__ import annotations

import io
import os
import random
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from tests.trust.attacks.attack import COLUMNS, TEXT, Attack, N, damaged, file

_SECRET = "secret.h5"


def _made(fill: Callable[[Any], None], log: bool = True) -> bytes:
    import h5py

    sink = io.BytesIO()
    with h5py.File(sink, "w") as out:
        if log:
            for name, values in COLUMNS.items():
                out[name] = values
        fill(out)
    return sink.getvalue()


def _beside(content: bytes, pipe: bool = False) -> Callable[[Path], str]:
    """A log beside a file that it must not read."""

    def make(directory: Path) -> str:
        import h5py

        if pipe:
            os.mkfifo(directory / _SECRET)
            os.mkfifo(directory / "raw.bin")
        else:
            with h5py.File(directory / _SECRET, "w") as out:
                for name, values in COLUMNS.items():
                    out[name] = values
            (directory / "raw.bin").write_bytes(COLUMNS["range_m"].tobytes())
        return file("a.h5", content)(directory)

    return make


def elsewhere(draw: random.Random) -> Iterator[Attack]:
    """Links, external storage and virtual datasets, of a range, of a column that is not needed, and of a group."""
    import h5py

    def link(name: str, path: str) -> Callable[[Any], None]:
        return lambda out: out.__setitem__(name, h5py.ExternalLink(_SECRET, path))

    def through(name: str) -> Callable[[Any], None]:
        def fill(out: Any) -> None:
            out["away"] = h5py.ExternalLink(_SECRET, "/")
            out[name] = h5py.SoftLink("/away/range_m")

        return fill

    def raw(name: str) -> Callable[[Any], None]:
        return lambda out: out.create_dataset(name, (N,), "f8", external=[("raw.bin", 0, h5py.h5f.UNLIMITED)])

    def virtual(name: str, most: int | None = N, pattern: str = _SECRET) -> Callable[[Any], None]:
        def fill(out: Any) -> None:
            layout = h5py.VirtualLayout((N,), "f8", maxshape=(most,))
            source = h5py.VirtualSource(pattern, "range_m", (N,), maxshape=(most,))
            if most is None:
                layout[0 : h5py.h5s.UNLIMITED] = source[0 : h5py.h5s.UNLIMITED]
            else:
                layout[:] = source
            out.create_virtual_dataset(name, layout)

        return fill

    def without_range(fill: Callable[[Any], None]) -> Callable[[Any], None]:
        def both(out: Any) -> None:
            for name in ("time_s", "azimuth_rad", "elevation_rad"):
                out[name] = COLUMNS[name]
            fill(out)

        return both

    for pipe in (False, True):
        word = "a pipe" if pipe else "a file"
        for label, of in {
            "a link": lambda name: link(name, "/range_m"), "a link through a link": through, "external storage": raw,
            "a virtual dataset": virtual, "an endless virtual dataset": lambda name: virtual(name, None),
            "a virtual dataset by another name": lambda name: virtual(name, N, f"./{_SECRET}"),
        }.items():  # fmt: skip
            content = _made(without_range(of("range_m")), log=False)
            yield Attack(
                f"{label} to {word} for a range",
                _beside(content, pipe),
                reads=False,
                says='"/away"' if of is through else '"/range_m"',
            )
            yield Attack(
                f"{label} to {word} beside", _beside(_made(of("other")), pipe), ("--keep-columns",), False, '"/'
            )
            deep = _made(lambda out, of=of: of("other")(out.create_group("deep")))
            yield Attack(f"{label} to {word} in another group", _beside(deep, pipe), reads=True)
        whole = _made(link("log", "/"), log=False)
        yield Attack(f"a link of all to {word}", _beside(whole, pipe), reads=False, says="log")
    loop = _made(lambda out: (out.__setitem__("a", h5py.SoftLink("/b")), out.__setitem__("b", h5py.SoftLink("/a"))))
    yield Attack("links in a circle", file("a.h5", loop), reads=True)
    circle = _made(lambda out: out.create_group("g").__setitem__("up", out["/"]))
    yield Attack("a group in itself", file("a.h5", circle), reads=True)
    soft = _made(
        lambda out: out.__setitem__("range_m", h5py.SoftLink("/raw/r")) or out.__setitem__("raw/r", COLUMNS["range_m"]),
        log=False,
    )
    yield Attack("a link inside", file("a.h5", soft))


def nowhere(draw: random.Random) -> Iterator[Attack]:
    """Datasets without values, and that unpack to much."""
    import h5py

    texts = h5py.string_dtype()
    n = 30_000_000
    for label, fill in {
        "not allocated": lambda o: [o.create_dataset(k, (10**9,), "f8") for k in COLUMNS],
        "in chunks": lambda o: [o.create_dataset(k, (10**10,), "f8", chunks=(10**6,)) for k in COLUMNS],
        "packed": lambda o: [
            o.create_dataset(k, data=np.zeros(n, "i1"), chunks=(n,), compression="gzip") for k in COLUMNS
        ],
        "fixed texts": lambda o: [o.create_dataset(k, (10**6,), "S10000") for k in COLUMNS],
        "a compound": lambda o: o.create_dataset("log", (10**9,), [(k, "f8") for k in COLUMNS]),
        "a matrix": lambda o: o.create_dataset("log", (10**9, 4), "f8"),
        "records of arrays": lambda o: o.create_dataset(
            "log", (50_000,), [("time_s", "f8"), ("range_m", "f8"), ("a", "f8", 10**5)]
        ),
    }.items():
        yield Attack(f"HDF5, {label}", file("a.h5", _made(fill, log=False)), reads=False)
        yield Attack(
            f"HDF5, {label} in a group beside",
            file("a.h5", _made(lambda o, f=fill: f(o.create_group("g")))),
            reads=True,
        )
    chunk = _made(
        lambda o: o.create_dataset("note", (N,), "f8", maxshape=(None,), chunks=(3 * 10**8,), compression="gzip")
    )
    yield Attack("HDF5, a chunk beyond the values", file("a.h5", chunk), ("--keep-columns",))

    def one_text(out: Any) -> None:
        """Very many texts, all at one place of the file: what h5py wrote for the first is written for all."""
        out.create_dataset("note", data=np.array(["q" * 300_000] + ["r"] * (N - 1), object), dtype=texts)

    content = _made(one_text)
    at = content.find(b"q" * 1000)
    yield Attack("HDF5, a long text", file("a.h5", content if at > 0 else b""), ("--keep-columns",), True)
    for label, make in {
        "nothing": lambda o: o.create_dataset("odd", data=h5py.Empty("f8")),
        "references": lambda o: o.create_dataset("odd", (N,), h5py.ref_dtype),
        "lists": lambda o: o.create_dataset("odd", (N,), h5py.vlen_dtype("f8")),
        "a point": lambda o: o.create_dataset("odd", data=5.0),
        "opaque": lambda o: o.create_dataset("odd", (N,), "V7"),
        "complex": lambda o: o.create_dataset("odd", (N,), "c16"),
        "truths": lambda o: o.create_dataset("odd", (N,), "?"),
        "long doubles": lambda o: o.create_dataset("odd", data=np.arange(N, dtype=np.longdouble)),
        "texts": lambda o: o.create_dataset("odd", (N,), texts),
        "a type": lambda o: o.__setitem__("odd", np.dtype([("a", "f8"), ("b", "f8")])),
        "a link to nothing": lambda o: o.__setitem__("odd", h5py.SoftLink("/none")),
        "a name that is no text": lambda o: o.__setitem__(b"\xff\xfe", COLUMNS["time_s"]),
        "a group for a column": lambda o: o.create_group("odd"),
        "no rows": lambda o: o.create_dataset("odd", (0,), "f8"),
        "a cube": lambda o: o.create_dataset("odd", (3, 4, 5), "f8"),
    }.items():
        yield Attack(f"HDF5, {label} beside", file("a.h5", _made(make)), reads=True)
        yield Attack(f"HDF5, {label} kept", file("a.h5", _made(make)), ("--keep-columns",))
    for value in (
        5.0,
        np.arange(4),
        h5py.Empty("f4"),
        b"\xff",
        "x" * 60_000,
        np.array(["m", "s"], object),
        [b"m"],
        True,
    ):

        def unit(out: Any, value: Any = value) -> None:
            out["time_s"].attrs["units"] = value

        yield Attack(f"HDF5, a unit of {str(value)[:30]}", file("a.h5", _made(unit)))
    deep = "/".join(["g"] * 3000)
    yield Attack("HDF5, 3,000 groups in each other", file("a.h5", _made(lambda o: o.create_group(deep))), reads=True)
    yield Attack(
        "HDF5, a long name", file("a.h5", _made(lambda o: o.__setitem__("n" * 5000, COLUMNS["time_s"]))), reads=False
    )
    yield Attack("HDF5 that is text", file("a.h5", TEXT), reads=False)
    yield Attack("text that is HDF5", file("a.csv", _made(lambda out: None)), reads=False)


def broken(draw: random.Random) -> Iterator[Attack]:
    """Bytes changed, in names too."""
    whole = _made(lambda out: None)
    for name in COLUMNS:
        for byte in (0, 255, 47, 10):
            content = bytearray(whole)
            content[whole.index(name.encode()) + draw.randrange(len(name))] = byte
            yield Attack(f"HDF5, byte {byte} in {name}", file("a.h5", bytes(content)))
    yield from damaged(whole, "a.h5", draw, 20)


ALL = (elsewhere, nowhere, broken)
