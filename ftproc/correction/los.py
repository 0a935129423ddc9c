"""Vectors of position and velocity between x, y, z and line-of-sight axes (radial, cross, up): what an
instrument does wrong is simple along the line of sight and complicated in x, y, z."""

from __future__ import annotations

import numpy as np

from ftproc.records import FloatArray


def to_los(axes: FloatArray, cartesian: FloatArray) -> FloatArray:
    """Position and velocity (n, 6) in x, y, z as components along `axes` (n, 3, 3), unit vectors in rows."""
    pairs = cartesian.reshape(len(cartesian), 2, 3)
    along: FloatArray = np.einsum("nij,npj->npi", axes, pairs).reshape(len(cartesian), 6)
    return along


def from_los(axes: FloatArray, along: FloatArray) -> FloatArray:
    """The inverse of `to_los`: (n, 6) components along `axes` (n, 3, 3) as x, y, z."""
    pairs = along.reshape(len(along), 2, 3)
    cartesian: FloatArray = np.einsum("nij,npi->npj", axes, pairs).reshape(len(along), 6)
    return cartesian
