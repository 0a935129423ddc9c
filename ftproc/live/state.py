"""What a stream keeps in a file, so that it goes on where it was after a crash: all that it knows, replaced now and
then, and after it what came since.

Nothing in such a file is executed: values are JSON and arrays, and objects are of the classes named here.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import io
import json
import struct
import types
from collections import deque
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np

from ftproc.core import by_hand, compiled
from ftproc.core.editing import gate, track, two_pass
from ftproc.core.filtering import records, smoother
from ftproc.core.live import (
    beside,
    doubt,
    editor,
    kept,
    pace,
    pieces,
    readings,
    recursive,
    rows,
    turning,
    whole,
    window,
)
from ftproc.core.live.newest import deciding
from ftproc.core.model import motion
from ftproc.correction import live as correction
from ftproc.errors import InputError, OutputError
from ftproc.files.writing import atomic
from ftproc.live import live, order, times
from ftproc.live.lines import forms, growing, plots
from ftproc.methods.height.priors import Prior

MAGIC = b"ftproc state 3\n"
_HEAD = struct.Struct("<Q16s")  # size and digest of what is known
_ENTRY = struct.Struct("<dBII")  # time of the clock, kind, size, and a check of all that

#: The classes of which objects are kept, and functions.
_KINDS: dict[str, Any] = {
    kind.__name__: kind
    for kind in (
        live.Live, order.Order, order._Copy, growing.Lines, forms.Form, forms.Json, forms.Nmea,
        forms.Cycle, plots.Plots,
        editor.LiveEditor, window.Window, recursive.GatedWindow, recursive.Gating, whole.Whole, doubt.Doubt,
        pace.Pace, pace.Clock, pieces.Sizes, readings.Columns, kept.Kept, pieces.Flown, readings.Labels,
        readings.Repeats, rows.Waiting, rows.Published, rows.Smoothed, records.Model, records.Start,
        smoother.SmootherRun, two_pass.Known, track.Track, gate.GateSettings, by_hand.Accepted, motion.Motion,
        motion.Jolts, beside.Rates, Prior, times.Times, times.Pause, turning.Second, turning.Turning, deciding.Deciding,
        correction.LiveCorrection, records.FilterRun,
    )
}  # fmt: skip
_FUNCTIONS = {"edit": two_pass.edit}
_LEFT_OUT = {"Live": ("settings", "_coasting", "_model")}  # of an object


class Kind:
    """Of what is appended."""

    DATA, NEWS, TICK, DELIVERED = range(4)


class Entry(NamedTuple):
    """What came since: bytes, or news of the source, at a time of the clock; a tick; how many rows were delivered."""

    now_s: float
    kind: int
    data: bytes = b""


def packed(value: Any) -> bytes:
    """A value, and all that it holds, as bytes. Raises TypeError for what is of no known kind."""
    arrays = list[np.ndarray[Any, Any]]()
    tree = json.dumps(_plain(value, arrays)).encode()
    text = io.BytesIO()
    text.write(struct.pack("<QQ", len(tree), len(arrays)) + tree)
    for array in arrays:
        np.lib.format.write_array(text, np.asarray(array), allow_pickle=False)
    return text.getvalue()


def unpacked(data: bytes) -> Any:
    """The value. Raises ValueError, KeyError, TypeError or such for other bytes."""
    text = io.BytesIO(data)
    size, count = struct.unpack("<QQ", text.read(16))
    tree = json.loads(text.read(size))
    arrays = [np.lib.format.read_array(text, allow_pickle=False) for _ in range(count)]
    return _object(tree, arrays)


def _plain(value: Any, arrays: list[Any]) -> Any:
    """JSON of a value whose arrays are put by."""

    def each(values: Any) -> list[Any]:
        return [_plain(one, arrays) for one in values]

    kind = type(value)
    if value is None or kind in (bool, int, float, str):
        return value
    if isinstance(value, np.ndarray):
        arrays.append(value)
        return {"array": len(arrays) - 1}
    if isinstance(value, np.generic):
        return value.item()
    if kind in (list, tuple, deque):
        return {kind.__name__: each(value)}
    if kind is dict:
        return {"dict": [each(item) for item in value.items()]}
    if kind in (bytes, bytearray):
        return {kind.__name__: value.hex()}
    if kind is functools.partial:
        return {"partial": value.func.__name__, "values": each([value.args, value.keywords])}
    if isinstance(value, types.MethodType):
        return {"method": value.__func__.__name__, "values": each([value.__self__])}
    if isinstance(value, type) and value.__name__ in _KINDS:
        return {"class": value.__name__}
    if _KINDS.get(kind.__name__) is not kind:
        raise TypeError(f"a {kind.__name__} cannot be kept")
    if isinstance(value, tuple):
        return {"of": kind.__name__, "values": each(value)}
    held = {name: one for name, one in (value.__getstate__() or {}).items() if name not in _left_out(kind)}
    return {"of": kind.__name__, "held": {name: _plain(one, arrays) for name, one in held.items()}}


def _left_out(kind: type) -> tuple[str, ...]:
    return _LEFT_OUT.get(kind.__name__, ())


def _object(tree: Any, arrays: list[Any]) -> Any:
    """The value of such JSON."""
    if not isinstance(tree, dict):
        return tree

    def each(values: Any) -> list[Any]:
        return [_object(one, arrays) for one in values]

    (what, value), *_ = tree.items()
    if what == "array":
        array = arrays[value]
        return array.view(np.recarray) if array.dtype.names and compiled.WAY == "python" else array
    simple: dict[str, Any] = {
        "list": list, "tuple": tuple, "deque": deque, "dict": lambda items: dict(items), "bytes": bytes,
        "bytearray": bytearray,
    }  # fmt: skip
    if what in ("bytes", "bytearray"):
        return simple[what](bytes.fromhex(value))
    if what == "dict":
        return {_object(key, arrays): _object(one, arrays) for key, one in value}
    if what in simple:
        return simple[what](each(value))
    if what == "class":
        return _KINDS[value]
    if what == "partial":
        arguments, named = each(tree["values"])
        return functools.partial(_FUNCTIONS[value], *arguments, **named)
    if what == "method":
        (owner,) = each(tree["values"])
        if not isinstance(owner, recursive.Gating) or value != "window":
            raise ValueError(value)
        return owner.window
    kind = _KINDS[value]
    if "values" in tree:
        return kind(*each(tree["values"]))
    made = kind.__new__(kind)
    held = {name: _object(one, arrays) for name, one in tree["held"].items()}
    if hasattr(kind, "__setstate__"):
        made.__setstate__(held)
    else:
        made.__dict__.update(held)
    return made


class StateFile:
    """The file of a stream. known: what it holds, None where there is none yet; since: what came after that."""

    def __init__(self, path: Path, purpose: str) -> None:
        """purpose: what the stream is, which must be the same. Raises InputError, OutputError."""
        self._path, self._purpose, self.since = path, purpose, list[Entry]()
        self.known: dict[str, Any] | None = None
        self._stream: BinaryIO | None = None
        atomic.check_target(path)
        if path.exists():
            self._read()

    def _read(self) -> None:
        text = self._path.read_bytes()
        begin = len(MAGIC) + _HEAD.size
        try:
            if not text.startswith(MAGIC):
                raise ValueError("not a state")
            size, digest = _HEAD.unpack(text[len(MAGIC) : begin])
            data = text[begin : begin + size]
            if hashlib.blake2b(data, digest_size=16).digest() != digest:
                raise ValueError("damaged")
            purpose, known = unpacked(data)
        except Exception as error:
            raise InputError(
                f"{self._path}: this is no state of a stream that this version of ftproc can go on with. Give --state "
                "another name, or delete the file to begin again."
            ) from error
        if purpose != self._purpose:
            raise InputError(
                f"{self._path}: this is the state of another stream, or of other options. Give --state another name, "
                "or delete the file to begin again."
            )
        self.known, self.since = known, list(_entries(text[begin + size :]))

    @property
    def is_new(self) -> bool:
        """Whether this run has kept nothing yet."""
        return self._stream is None

    def replace(self, known: dict[str, Any]) -> None:
        """Keep this from now on, and nothing of what came before. Raises OutputError."""
        data = packed((self._purpose, known))
        head = MAGIC + _HEAD.pack(len(data), hashlib.blake2b(data, digest_size=16).digest())
        self.close()
        with atomic.replacing(self._path, synced=False) as stream:
            stream.write(head)
            stream.write(data)
        self._stream = self._path.open("ab", buffering=0)

    def add(self, entry: Entry) -> None:
        """Keep what has come. Raises OutputError."""
        if self._stream is None:
            return
        head = _ENTRY.pack(entry.now_s, entry.kind, len(entry.data), _check(entry))
        try:
            self._stream.write(head + entry.data)
        except OSError as error:
            raise OutputError(f"{self._path}: cannot be written ({error.strerror}); make room.") from error

    def close(self) -> None:
        if self._stream is not None:
            self._stream.close()
            self._stream = None


def _check(entry: Entry) -> int:
    text = struct.pack("<dB", entry.now_s, entry.kind) + entry.data
    return int.from_bytes(hashlib.blake2b(text, digest_size=4).digest(), "little")


def _entries(text: bytes) -> Iterator[Entry]:
    """Up to one that is not whole."""
    low = 0
    with contextlib.suppress(struct.error):
        while low < len(text):
            now_s, kind, size, check = _ENTRY.unpack_from(text, low)
            low += _ENTRY.size
            entry = Entry(now_s, kind, text[low : low + size])
            if len(entry.data) < size or _check(entry) != check:
                return
            yield entry
            low += size
