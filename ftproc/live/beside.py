"""What the lines of a log that is followed hold beside range, azimuth and elevation: range rates, and heights where no
elevation is measured. Each height becomes an elevation, with the range of its own row."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ftproc.config.recipe import Recipe
from ftproc.core.components import bounded
from ftproc.files.options import parse_columns, parse_units
from ftproc.files.reading import further
from ftproc.files.reading.further import Further
from ftproc.files.words import QUANTITIES
from ftproc.methods.height import heights
from ftproc.methods.height.priors import ANY, SPECIFIED, Prior
from ftproc.records import FloatArray

RANGE, ELEVATION = QUANTITIES.index("range"), QUANTITIES.index("elevation")
RATE = len(QUANTITIES)  # the column of range rates, after those of all logs


class Columns(NamedTuple):
    """The columns, the height of the station, m, and what is known of the target's if none is measured. Heights
    stand in the column of elevations until they are these. unused: the column of heights beside elevations."""

    rate: Further | None = None
    height: Further | None = None
    own_m: float = 0.0
    prior: Prior | None = None
    unused: str = ""

    @classmethod
    def of(cls, names: Sequence[str], row: Sequence[str], found: Mapping[str, Any], recipe: Recipe) -> Columns:
        """By the names of columns, the row of units below them, and what else has been found."""
        stated = names, row, parse_units(recipe.units), parse_columns(recipe.columns)
        rate, height = (further.by_name(each, *stated) for each in (further.RANGE_RATE, further.HEIGHT))
        plane = {"range", "azimuth"} <= set(found) and "elevation" not in found
        site = recipe.settings.site
        specified = recipe.settings.height
        unused = height.name if height is not None and "elevation" in found else ""
        height = height if plane and specified is None else None
        prior = Prior(*specified, SPECIFIED) if specified else ANY
        return cls(rate, height, site[2] if site else 0.0, prior if plane and height is None else None, unused)

    @property
    def barometric(self) -> bool | None:
        """Whether the heights are; None without."""
        return None if self.height is None else self.height.other_kind

    def fill(self, row: list[float], cells: Sequence[str]) -> None:
        """Put the numbers of a line in their places, in the units of the log."""
        for k, column in ((RATE, self.rate), (ELEVATION, self.height)):
            if column is not None:
                with contextlib.suppress(ValueError):  # "n/a" and the like
                    row[k] = float(cells[column.position])

    def rates(self, value: FloatArray) -> FloatArray:
        """(n,) m/s, outward if the name says inward."""
        return value if self.rate is None else self.rate.to_si(value)

    def split(self, readings: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Range, azimuth and elevation (n, 3) of readings (n, 5), and (n,) heights above the station, m."""
        measurement = bounded(readings[:, RANGE:RATE])
        if self.height is None:
            return measurement, np.full(len(measurement), np.nan)
        above = bounded(self.height.to_si(measurement[:, -1])) - self.own_m
        measurement[:, -1] = np.nan
        return measurement, above

    def joined(self, measurement: FloatArray, above_m: FloatArray) -> FloatArray:
        """The readings (n, 3) with elevations by the heights."""
        if self.height is None:
            return measurement
        return np.column_stack([measurement[:, :2], heights.elevation(above_m, measurement[:, 0])])
