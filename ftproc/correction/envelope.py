"""Statistics of the training data: the normalisation of columns, and the region that its inputs cover."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ftproc.correction.features import BoolArray
from ftproc.correction.network import blocks
from ftproc.records import FloatArray

TAIL = 0.001  # share of good samples that may lie outside
STIFFEST = 0.05  # smallest variance of a direction of the normalised inputs


@dataclass(frozen=True)
class Normaliser:
    """z = (x - mean) / scale, per column; mean and scale (d,)."""

    mean: FloatArray
    scale: FloatArray

    @classmethod
    def fit(cls, columns: FloatArray, floor: FloatArray | float) -> Normaliser:
        """Mean and standard deviation of (n, d) columns, the latter not below `floor`."""
        return cls(columns.mean(axis=0), np.maximum(columns.std(axis=0), floor))

    def forward(self, columns: FloatArray) -> FloatArray:
        return (columns - self.mean) / self.scale

    def back(self, columns: FloatArray) -> FloatArray:
        return columns * self.scale + self.mean


@dataclass(frozen=True)
class Envelope:
    """The region that the training inputs cover: squared Mahalanobis distance z' precision z of normalised inputs z, up
    to a limit.

    precision: (d, d) symmetric. limit: dimensionless.
    """

    precision: FloatArray
    limit: float

    @classmethod
    def fit(cls, normalised: FloatArray, reach: float = 1.0) -> Envelope:
        """From the training inputs (n, d), with floored eigenvalues of their covariance; radii are scaled by `reach`.

        The limit is the 99.9 % quantile of chi-square(d), or that of the training inputs if it is larger: a filter
        with too little process noise has long tails of innovations, and these are what is to be corrected.
        """
        from scipy.special import chdtri

        value, vector = np.linalg.eigh(normalised.T @ normalised / len(normalised))
        precision = (vector / np.maximum(value, STIFFEST)) @ vector.T
        distance = cls(precision, np.inf).distance(normalised)
        limit = max(chdtri(len(value), TAIL), np.quantile(distance, 1.0 - TAIL))
        return cls(precision, float(limit) * reach**2)

    def distance(self, normalised: FloatArray) -> FloatArray:
        """(n,) squared Mahalanobis distance of normalised inputs (n, d)."""
        squared = np.empty(len(normalised))
        for rows in blocks(len(normalised), self.precision.size):
            z = normalised[rows]
            squared[rows] = np.einsum("ij,ij->i", z @ self.precision, z)
        return squared

    def contains(self, normalised: FloatArray) -> BoolArray:
        """(n,) mask for normalised inputs (n, d)."""
        return self.distance(normalised) <= self.limit
