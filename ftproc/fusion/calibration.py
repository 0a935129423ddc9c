"""The biases that a fused flight has shown, written into station files for the next flight of each instrument."""

from __future__ import annotations

import math
from pathlib import Path

from ftproc.config import writing
from ftproc.files.writing import atomic
from ftproc.fusion.constants import Constants
from ftproc.fusion.events import CLOCK
from ftproc.fusion.range_file import Instrument, Range

SENSE = {"x": "anticlockwise", "north": "clockwise"}


def write(range_: Range, constants: Constants, folder: Path) -> None:
    """A station file for each station: what it had, with the observable biases added and its clock set right.

    A station file has no tilts; what is seen of them in the readings of other flights depends on the direction.
    """
    for s, instrument in enumerate(range_.instruments):
        with atomic.replacing(folder / f"{instrument.name}.toml") as stream:
            stream.write(text(instrument, constants, s).encode())


def text(instrument: Instrument, constants: Constants, s: int) -> str:
    """The station file with the biases of a flight."""
    options = dict(instrument.options)
    estimate, told = constants.estimate[s], constants.observable[s]
    station = instrument.recipe.station
    sense = -1.0 if (station.azimuth_sense or SENSE[station.azimuth_from]) == "clockwise" else 1.0
    zenith = -1.0 if station.elevation_from == "zenith" else 1.0
    before = options.get("bias") or (0.0, 0.0, 0.0)
    signs = (1.0, sense, zenith)  # in the sense of the readings as they are written
    options["bias"] = tuple(before[c] + signs[c] * float(estimate[c]) if told[c] else before[c] for c in range(3))
    if told[CLOCK]:
        options["time_offset_s"] = options.get("time_offset_s", 0.0) - float(estimate[CLOCK])
    if instrument.site is not None:
        options.setdefault("site", instrument.site)
    head = "# Biases, reading minus truth, and the time to add, as a fused flight has shown them.\n"
    if told[3:CLOCK].any():
        tilts = " and ".join(
            f"{1e3 * estimate[3 + j]:.4g} mrad about {axis}" for j, axis in enumerate(("east", "north")) if told[3 + j]
        )
        head += f"# Tilts, which a station file does not hold: {tilts}.\n"
    assert all(math.isfinite(value) for value in options["bias"])
    return head + writing.dump(options)
