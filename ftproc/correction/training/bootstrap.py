"""Block bootstrap, for errors that are correlated in time: long blocks are drawn, not samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ftproc.records import FloatArray, IntArray

DRAWS = 1000  # enough for a quantile of 0.8 %
SHORTEST_S, LONGEST_S, BLOCKS = 5.0, 30.0, 40
WHOLE_PIECES = 8  # so many pieces (flights, or separate blocks of flights), or more, are drawn whole


@dataclass(frozen=True)
class Blocks:
    """Which block each of n samples is in, and which piece each of b blocks. block: (n,), piece: (b,) ascending."""

    block: IntArray
    piece: IntArray

    @classmethod
    def of(cls, times_s: Sequence[FloatArray]) -> Blocks:
        """For pieces with these sample times: whole pieces when there are eight, else about forty blocks of 5 s to
        30 s, longer than errors stay correlated."""
        times = [t for t in times_s if len(t)]
        length = np.clip(sum(float(t[-1] - t[0]) for t in times) / BLOCKS, SHORTEST_S, LONGEST_S)
        block, piece = [np.empty(0, np.int64)], [np.empty(0, np.int64)]
        for number, t in enumerate(times):
            span = float(t[-1] - t[0])
            count = 1 if len(times) >= WHOLE_PIECES else max(int(span // length), 1)
            cut = np.minimum((t - t[0]) * (count / span) // 1, count - 1) if span > 0.0 else np.zeros(len(t))
            own = np.unique(cut, return_inverse=True)[1]
            block.append(own + sum(len(p) for p in piece))
            piece.append(np.full(int(own.max()) + 1, number))
        return cls(np.concatenate(block), np.concatenate(piece))

    def __len__(self) -> int:
        return len(self.piece)

    def sums(self, values: FloatArray) -> FloatArray:
        """Columns of `values` (n, c) summed over each block: (b, c)."""
        sums = np.zeros((len(self), values.shape[1]))
        np.add.at(sums, self.block, values)
        return sums

    def totals(self, sums: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Totals (draws, c) of block sums (b, c): pieces are drawn with replacement, then blocks within each.

        Drawing blocks alone would make two flights with a similar error by chance significant.
        """
        pieces, start, size = np.unique(self.piece, return_index=True, return_counts=True)
        drawn = rng.multinomial(len(pieces), np.full(len(pieces), 1 / len(pieces)), size=DRAWS)
        totals = np.zeros((DRAWS, sums.shape[1]))
        for p, (first, many) in enumerate(zip(start, size, strict=True)):
            # A piece drawn c times gives c times its number of blocks, each any of its blocks.
            count = rng.multinomial(drawn[:, p] * many, np.full(many, 1 / many))
            totals += count @ sums[first : first + many]
        return totals
