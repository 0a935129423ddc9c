"""Work on long records: in chunks of rows, every so many of them, and stretches joined to a whole."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from ftproc.records import Beside, Diagnostics, FloatArray, Trajectory, forget

Stretch = TypeVar("Stretch", Diagnostics, Trajectory)


def thinned(array: FloatArray, most: int) -> FloatArray:
    """Every k-th row of an array (n, ...), at most `most`; little of a mapped array is in memory at a time."""
    every = 1 + max(len(array) - 1, 0) // most
    found = []
    for rows in chunks(len(array), every * max((1 << 20) // every, 1)):
        found.append(np.array(array[rows][::every]))
        forget(array)
    return np.concatenate(found) if found else np.array(array)


def chunks(n: int, rows: int = 1 << 20) -> Iterator[slice]:
    """Slices of `rows` rows that cover n of them."""
    for low in range(0, n, rows):
        yield slice(low, min(low + rows, n))


def joined(parts: Sequence[Trajectory]) -> Trajectory:
    """Consecutive stretches of one trajectory as a whole; the metadata are those of the first."""
    if len(parts) == 1:
        return parts[0]
    extra = None
    if parts[0].extra is not None:
        import pyarrow as pa

        extra = pa.concat_tables([part.extra for part in parts])
    present = [part.diagnostics for part in parts if part.diagnostics is not None]
    whole = None
    if len(present) == len(parts):
        names = present[0].beside
        beside = {each: Beside._make(map(np.concatenate, zip(*(d.beside[each] for d in present), strict=True)))
                  for each in names}  # fmt: skip
        whole = replace(_concatenated(present, "reading", "residual", "residual_sigma"), beside=beside)
    arrays: tuple[str, ...] = (
        "row", "time_s", "measurement", "state", "sigma", "measurement_sigma", "outlier", "nis", "correction",
    )  # fmt: skip
    if all(part.path_sigma is not None for part in parts):
        arrays += ("path_sigma",)
    return replace(_concatenated(parts, *arrays), diagnostics=whole, extra=extra)


def _concatenated(parts: Sequence[Stretch], *names: str) -> Stretch:
    """The first record, with these arrays of all of them."""
    arrays: Any = {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}
    return replace(parts[0], **arrays)
