"""ASTERIX plots of radars as they come: data blocks in, the lines of a table out.

What the table's names leave open the categories settle: azimuths count clockwise from north.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from ftproc.files.reading.formats.standards import octets
from ftproc.live.lines.forms import DAY_S, Cycle
from ftproc.live.lines.growing import LINES, Block

NAMES = ("time_s", "target", "range_m", "azimuth_deg")
NMI_M = 1852.0
_TAB = 9
#: Category -> metres in a unit of its ranges, the item of its times, and after how many seconds these begin again.
_PLOTS = {
    48: (NMI_M, "I140.ToD", DAY_S), 1: (NMI_M, "I141.TToD", 512.0), 10: (1.0, "I140.ToD", DAY_S),
}  # fmt: skip
_TARGETS = ("I220.ACAddr", "I161.Tn", "I070.Mode3A", "I060.Mode3A")  # the first that a plot has


def is_asterix(data: bytes) -> bool:
    """Whether a stream begins with a data block of a category that is known, and no text: the second octet, of the
    block's length, is one that texts do not have."""
    return len(data) > 1 and data[0] in octets.CATEGORIES and data[1] < _TAB


class Plots:
    """Bytes in, lines out, as `growing.Lines`. number: of lines so far."""

    def __init__(self) -> None:
        self.number, self._rest, self._cycles = 0, bytearray(), dict[int, Cycle]()

    def begin_again(self) -> bool:
        """The content is another one; whether a block is left incomplete, which is dropped."""
        cut = bool(self._rest)
        self._rest, self.number = bytearray(), 0
        return cut

    def blocks(self, data: bytes) -> Iterator[Block]:
        """The plots in the data blocks that are complete now; the names stand before the first."""
        self._rest += data
        size = octets.whole_blocks(self._rest)
        whole, self._rest = bytes(self._rest[:size]), self._rest[size:]
        lines = [] if self.number else [",".join(NAMES)]
        lines += [line for record in octets.records(whole) if (line := self._line(record))]
        first, self.number = self.number + 1, self.number + len(lines)
        for low in range(0, len(lines), LINES):
            yield Block(first + low, lines[low : low + LINES])

    def last(self) -> Iterator[Block]:
        """Of a block that is not complete nothing is known."""
        return iter(())

    def _line(self, record: octets.Record) -> str:
        """The row of a plot; empty of what is none."""
        category, row = record
        if category not in _PLOTS or "I040.RHO" not in row:
            return ""
        unit_m, time, period_s = _PLOTS[category]
        if time not in row:
            return ""
        time_s = self._cycles.setdefault(category, Cycle(period_s)).unfolded(float(row[time]))
        return f"{time_s!r},{_target(row)},{float(row['I040.RHO']) * unit_m!r},{float(row['I040.THETA'])!r}"


def _target(row: Mapping[str, float | str]) -> str:
    return next((str(row[name]) for name in _TARGETS if name in row), "")
