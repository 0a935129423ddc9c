"""The in-h-out back-propagation network: tanh hidden layer, linear output (Zuo et al. 2021, section 2.1).

All weights form one vector [W1, b1, W2, b2, direct connections if any], which is also the chromosome of the genetic
search.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ftproc.records import FloatArray

BLOCK_WORK = 200_000  # multiplications in one matrix product


class Shape(NamedTuple):
    """Layer sizes of a network. direct: direct connections from inputs to outputs, for the linear part."""

    inputs: int
    hidden: int
    outputs: int
    direct: bool = False

    @property
    def size(self) -> int:
        """Number of weights: 237 for the paper's 9-12-9."""
        return self.inner + self.outputs * (self.regressors + 1)

    @property
    def inner(self) -> int:
        """Number of weights into the hidden layer; given these, the optimal others are a linear least-squares fit."""
        return self.hidden * (self.inputs + 1)

    @property
    def regressors(self) -> int:
        """Number of terms of an output, without its bias."""
        return self.hidden + (self.inputs if self.direct else 0)


class Weights(NamedTuple):
    """w1 (h, d), b1 (h,), w2 (o, h), b2 (o,), direct (o, d), or (o, 0) without direct connections; all dimensionless
    (inputs and targets are normalised)."""

    w1: FloatArray
    b1: FloatArray
    w2: FloatArray
    b2: FloatArray
    direct: FloatArray


def unpack(vector: FloatArray, shape: Shape) -> Weights:
    """Views into `vector` (size,) as layers."""
    d, h, o, _ = shape
    first, second, third, fourth = np.cumsum([h * d, h, o * h, o])
    return Weights(
        vector[:first].reshape(h, d),
        vector[first:second],
        vector[second:third].reshape(o, h),
        vector[third:fourth],
        vector[fourth:].reshape(o, -1),
    )


def pack(weights: Weights) -> FloatArray:
    """The layers as one vector (size,): the inverse of `unpack`."""
    return np.concatenate([part.ravel() for part in weights])


def scale(shape: Shape) -> FloatArray:
    """(size,) 1/sqrt(fan-in) of each weight, by which a gene in [-1, 1] is multiplied.

    Without it the tanh of a network of 30 and more inputs are saturated at first, and the gradient is zero.
    """
    into_hidden, into_output = 1.0 / np.sqrt(shape.inputs), 1.0 / np.sqrt(shape.regressors)
    return np.repeat([into_hidden, into_output], [shape.inner, shape.size - shape.inner])


def blocks(rows: int, work: int) -> Iterator[slice]:
    """Rows in blocks whose matrix products, of `work` multiplications per row, a BLAS does in one thread (OpenBLAS:
    below 262144).

    Threads cost more than they gain in so small a product, and with fixed blocks the sums do not depend, to the last
    bit, on the number of threads.
    """
    step = max(BLOCK_WORK // work, 32)
    return (slice(first, first + step) for first in range(0, rows, step))


def forward(weights: Weights, inputs: FloatArray) -> FloatArray:
    """Network output (n, o) for normalised inputs (n, d)."""
    output = np.empty((len(inputs), len(weights.b2)))
    for rows in blocks(len(inputs), weights.w1.size):
        output[rows] = np.tanh(inputs[rows] @ weights.w1.T + weights.b1) @ weights.w2.T + weights.b2
        if weights.direct.size:
            output[rows] += inputs[rows] @ weights.direct.T
    return output


def squares(weights: Weights, inputs: FloatArray, targets: FloatArray) -> FloatArray:
    """(o,) sums of the squared errors of each output over the samples."""
    return np.asarray(np.sum((forward(weights, inputs) - targets) ** 2, axis=0))


def cost(vector: FloatArray, shape: Shape, inputs: FloatArray, targets: FloatArray) -> float:
    """E/n: squared error summed over outputs (seed eq. 13), mean over the n samples."""
    residual = forward(unpack(vector, shape), inputs) - targets
    return float(np.vdot(residual, residual)) / len(inputs)


def cost_and_gradient(
    vector: FloatArray, shape: Shape, inputs: FloatArray, targets: FloatArray, decay: float
) -> tuple[float, FloatArray]:
    """E/n + decay * sum(w1^2 + w2^2 + direct^2) and its gradient (size,) by back-propagation.

    d2 = 2 (Y - T)/n, dW2 = d2' H, d1 = (d2 W2) * (1 - H^2), dW1 = d1' X, dDirect = d2' X. Biases do not decay: they
    carry the repeatable part of the error.
    """
    w = unpack(vector, shape)
    n = len(inputs)
    value = decay * sum(float(np.vdot(part, part)) for part in (w.w1, w.w2, w.direct))
    gradient = np.zeros_like(vector)
    slope = unpack(gradient, shape)
    for rows in blocks(n, w.w1.size):
        x = inputs[rows]
        hidden = np.tanh(x @ w.w1.T + w.b1)
        residual = hidden @ w.w2.T + w.b2 - targets[rows]
        if shape.direct:
            residual += x @ w.direct.T
        value += float(np.vdot(residual, residual)) / n
        delta2 = residual * (2.0 / n)
        delta1 = (delta2 @ w.w2) * (1.0 - hidden * hidden)
        for total, part in zip(slope[:4], (delta1.T @ x, delta1.sum(0), delta2.T @ hidden, delta2.sum(0)), strict=True):
            total += part
        if shape.direct:
            slope.direct[...] += delta2.T @ x
    for total, part in zip(slope[::2], w[::2], strict=True):  # all but the biases
        total += 2.0 * decay * part
    return value, gradient


def least_squares(inner: FloatArray, shape: Shape, inputs: FloatArray, targets: FloatArray, ridge: float) -> FloatArray:
    """The whole vector (size,) for given weights into the hidden layer (inner,): all others by least squares.

    Minimises E/n + ridge * sum(w2^2 + direct^2), a linear problem. With zero `inner` this is linear regression.
    """
    w = unpack(np.concatenate([inner, np.zeros(shape.size - shape.inner)]), shape)
    n, m = len(inputs), shape.regressors
    normal, right = np.zeros((m + 1, m + 1)), np.zeros((m + 1, shape.outputs))
    for rows in blocks(n, (m + 1) * (m + 1)):
        hidden = np.tanh(inputs[rows] @ w.w1.T + w.b1)
        direct = inputs[rows] if shape.direct else hidden[:, :0]
        columns = np.concatenate([hidden, direct, np.ones((len(hidden), 1))], axis=1)
        normal += columns.T @ columns
        right += columns.T @ targets[rows]
    normal[np.arange(m), np.arange(m)] += n * ridge
    found = np.asarray(np.linalg.solve(normal, right).T, np.float64)
    h = shape.hidden
    return pack(w._replace(w2=found[:, :h], b2=found[:, m], direct=found[:, h:m]))


def population_cost(population: FloatArray, shape: Shape, inputs: FloatArray, targets: FloatArray) -> FloatArray:
    """(p,) E/n of each of p networks (p, size), one after the other: faster than one large product."""
    return np.array([cost(vector, shape, inputs, targets) for vector in population])
