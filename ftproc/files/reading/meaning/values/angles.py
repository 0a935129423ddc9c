"""Cells and digits that are angles in degrees, minutes and seconds, or a bearing in a quadrant, -> degrees."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

from ftproc.files.reading.meaning.numbers import Origin, numbers
from ftproc.records import FloatArray

if TYPE_CHECKING:
    import pyarrow as pa

_DMS = (
    r"^(?P<sign>[+-]?)(?P<deg>\d{1,3})\s*[°ºd:\- ]\s*(?P<min>\d{1,2}(?:[.,]\d+)?)\s*(?:['’′m:\- ]\s*"
    r"(?:(?P<sec>\d{1,2}(?:[.,]\d*)?)\s*(?:\"|''|”|″|s)?)?)?$"
)
_DOTTED = r"^([+-]?\d{1,3})\.(\d{1,2})\.(\d{1,2}(?:[.,]\d*)?)$"  # 123.45.06
_QUADRANT = r"^(?P<from>[NSns])\s*(?P<angle>\d.*?)\s*(?P<to>[EWew])$"  # N 45°30' E, 45°30' from north towards east
_MOST_TURN, _MOST_OF_A_QUADRANT = 720.0, 90.0  # deg
_PACKED = re.compile(r"d+m+s+f*")  # notations of degrees, minutes and seconds in the digits of one number
_MINUTES = re.compile(r"d+m+")  # of degrees and minutes
_LARGEST = {"azimuth": 360.0, "elevation": 90.0}  # deg


def sexagesimal(text: pa.ChunkedArray, origin: Origin) -> FloatArray | None:
    """(n,) degrees of cells of degrees, minutes and perhaps seconds; None if these are others."""
    import pyarrow as pa
    import pyarrow.compute as pc

    fields = pc.extract_regex(pc.replace_substring_regex(text, _DOTTED, r"\1 \2 \3"), pattern=_DMS)
    if fields.null_count > text.null_count:
        return None

    def part(name: str) -> FloatArray:
        cells = pc.replace_substring(pc.struct_field(fields, name), ",", ".")
        present = numbers(pc.if_else(pc.equal(cells, ""), None, cells).cast(pa.float64()), origin)
        return np.where(np.isfinite(degrees), np.nan_to_num(present), np.nan) if name != "deg" else present

    degrees = part("deg")
    sign = np.where(np.array([cell == "-" for cell in pc.struct_field(fields, "sign").to_pylist()]), -1.0, 1.0)
    minutes, seconds = part("min"), part("sec")
    _refuse(text, (minutes >= 60) | (seconds >= 60) | (degrees > _MOST_TURN), origin)
    return joined(sign, degrees, minutes, seconds)


def in_quadrants(text: pa.ChunkedArray, origin: Origin) -> FloatArray | None:
    """(n,) degrees clockwise from north of bearings in quadrants; None if the cells are others."""
    import pyarrow.compute as pc

    fields = pc.extract_regex(text, pattern=_QUADRANT)
    if fields.null_count > text.null_count:
        return None
    cells = pc.struct_field(fields, "angle")
    angles = sexagesimal(cells, origin)
    if angles is None:
        angles = numbers(pc.replace_substring_regex(cells, r"\s*(°|º|deg)$", ""), origin)
    _refuse(text, angles > _MOST_OF_A_QUADRANT, origin)
    south, west = (
        np.array([cell is not None and cell in letters for cell in pc.struct_field(fields, name).to_pylist()])
        for name, letters in (("from", "Ss"), ("to", "Ww"))
    )
    turned = np.where(south != west, -angles, angles)
    return np.where(south, 180.0, 0.0) + turned


def _refuse(text: pa.ChunkedArray, wrong: np.ndarray, origin: Origin) -> None:
    """Raise InputError for the first cell that is wrong."""
    if wrong.any():
        row = int(np.argmax(wrong))
        raise origin.bad_cell(row, str(text[row]), "an angle in degrees, minutes and seconds")


def joined(sign: FloatArray, degrees: FloatArray, minutes: FloatArray, seconds: FloatArray) -> FloatArray:
    """(n,) degrees of their parts."""
    return sign * (degrees + (minutes + seconds / 60.0) / 60.0)


def unpacked(values: FloatArray, notation: str, name: str, quantity: str) -> FloatArray | None:
    """(n,) degrees of numbers whose digits are degrees, minutes and perhaps seconds; None for another notation."""
    if quantity not in _LARGEST:
        return None
    if _PACKED.fullmatch(notation):
        return _from_digits(values)
    if not _MINUTES.fullmatch(notation):
        return None
    behind_a_point = re.search(r"d\W+m", name.lower()) or not (np.abs(values) > _LARGEST[quantity]).any()
    size = np.round(np.abs(values) * (100 if behind_a_point else 1), 7)  # 302.4705, or 30247.05: 302°47.05'
    return np.sign(values) * (np.floor(size / 100) + size % 100 / 60)


def _from_digits(values: FloatArray) -> FloatArray:
    """(n,) degrees of numbers whose digits are degrees, minutes and seconds: 1234506.7, or 123.45067."""
    sign: FloatArray = np.sign(values)
    size: FloatArray = np.abs(values)
    if size.size and np.nanmax(size) < 1000:
        size = size * 1e4
    size = np.round(size, 6)
    seconds: FloatArray = size % 100
    return joined(sign, np.floor(size / 1e4), np.floor(size / 100) % 100, seconds)
