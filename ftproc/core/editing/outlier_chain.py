"""Which readings are outliers, from the whole record: a hidden Markov chain per component.

Each sample is good, an isolated outlier, or part of a patch. Given the leave-one-out residual r of a component
(variance v, from the smoother), good samples are N(0, v), bad ones N(0, v + (WIDE sigma)^2). Isolated outliers come
independently at a rate; a patch begins at a rate and tends to go on. The rates are the log's own, by the
Baum-Welch recursion. The chain is what finds the small members of a patch, by their neighbours, and what keeps it
from calling everything between two spikes a patch.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import kernel, part
from ftproc.core.signatures import Matrix, Vector

FloatArray = NDArray[np.float64]

WIDE = 25.0  # 1-sigma of a bad reading, in sigmas of the noise
NATURAL_GATE = 4.0  # sigmas at which the chain gives up a lone reading, about; another gate stretches the scale
START_RATES = (0.02, 0.001, 0.92)  # isolated outlier; patch begins; patch goes on
MAX_RATES = (0.4, 0.02, 0.98)
MIN_STAY = 0.7
PRIOR_SAMPLES = 20.0  # weight of START_RATES' spirit against the counts of the log
ROUNDS = 3


@part
def _chain(
    residual: FloatArray,
    variance: FloatArray,
    noise: float,
    stretch: float,
    rates: FloatArray,
    good: FloatArray,
    counts: FloatArray,
) -> None:
    """Forward-backward recursion: fills good (n,) = P(good | all) and the expected transition counts (3, 3)."""
    n = len(residual)
    isolated, begins, stays = rates
    step = np.empty((3, 3))
    for i in range(2):
        step[i, 0], step[i, 1], step[i, 2] = 1 - isolated - begins, isolated, begins
    step[2, 0], step[2, 1], step[2, 2] = (1 - stays) * (1 - isolated), (1 - stays) * isolated, stays
    likely, filtered = np.ones((n, 2)), np.zeros((n, 3))
    ahead = step[0].copy()
    for k in range(n):
        if not math.isfinite(residual[k]):
            continue
        narrow = stretch * variance[k]
        wide = narrow + WIDE * WIDE * noise
        ratio = 0.5 * residual[k] ** 2 * (1 / narrow - 1 / wide) - 0.5 * math.log(wide / narrow)
        likely[k, 0] = math.exp(min(0.0, -ratio))
        likely[k, 1] = math.exp(min(0.0, ratio))
        total = 0.0
        for j in range(3):
            filtered[k, j] = ahead[j] * likely[k, min(j, 1)] + 1e-300
            total += filtered[k, j]
        for j in range(3):
            filtered[k, j] /= total
        for j in range(3):
            ahead[j] = filtered[k, 0] * step[0, j] + filtered[k, 1] * step[1, j] + filtered[k, 2] * step[2, j]
    back, behind = np.ones(3), np.ones(3)
    later = -1
    counts[:] = 0.0
    for k in range(n - 1, -1, -1):
        good[k] = 0.0
        if not math.isfinite(residual[k]):
            continue
        if later >= 0:
            total = 0.0
            for i in range(3):
                behind[i] = 0.0
                for j in range(3):
                    behind[i] += step[i, j] * likely[later, min(j, 1)] * back[j]
                total += filtered[k, i] * behind[i]
            for i in range(3):
                for j in range(3):
                    pair = filtered[k, i] * step[i, j] * likely[later, min(j, 1)] * back[j]
                    counts[i, j] += pair / max(total, 1e-300)
            scale = behind[0] + behind[1] + behind[2]
            for i in range(3):
                back[i] = behind[i] / scale
        total = 0.0
        for i in range(3):
            total += filtered[k, i] * back[i]
        good[k] = filtered[k, 0] * back[0] / max(total, 1e-300)
        later = k


@part
def _estimate_rates(counts: FloatArray, rates: FloatArray) -> None:
    """Baum-Welch update of the rates, drawn towards rare outliers where the log says little."""
    outside = counts[0].sum() + counts[1].sum()
    isolated = (counts[0, 1] + counts[1, 1] + 0.005 * PRIOR_SAMPLES) / (outside + PRIOR_SAMPLES)
    begins = (counts[0, 2] + counts[1, 2] + 0.0005 * PRIOR_SAMPLES) / (outside + PRIOR_SAMPLES)
    stays = (counts[2, 2] + START_RATES[2] * PRIOR_SAMPLES) / (counts[2].sum() + PRIOR_SAMPLES)
    rates[0] = min(isolated, MAX_RATES[0])
    rates[1] = min(begins, MAX_RATES[1])
    rates[2] = min(max(stays, MIN_STAY), MAX_RATES[2])


@kernel
def classify(residual: Matrix, variance: Matrix, noise_variance: Vector, rates: Matrix, gate: float) -> Matrix:
    """(n, 3) probability that each reading is good; zero where missing. `rates` (3, 3) are estimated in place.

    residual, variance: (n, 3) leave-one-out, from the smoother; noise_variance (3,). gate: sigmas.
    """
    stretch = (gate / NATURAL_GATE) ** 2
    n = residual.shape[0]
    good, counts, column = np.zeros((n, 3)), np.zeros((3, 3)), np.zeros(n)
    for c in range(3):
        r, v = residual[:, c].copy(), variance[:, c].copy()
        for _ in range(ROUNDS):
            _chain(r, v, noise_variance[c], stretch, rates[c], column, counts)
            _estimate_rates(counts, rates[c])
        for k in range(n):
            good[k, c] = column[k]
    return good


@kernel
def label_runs(weight: Matrix, measurement: Matrix, longest_isolated: int) -> Matrix:
    """(n, 3) labels as float: 0 good, 1 isolated, 2 patch (a longer run of rejections), 3 missing.

    Missing readings within a run of rejections neither end it nor count towards it.
    """
    n = weight.shape[0]
    label = np.zeros((n, 3))
    for c in range(3):
        begin, count = -1, 0
        for k in range(n + 1):
            if k < n and not math.isfinite(measurement[k, c]):
                label[k, c] = 3
                continue
            if k < n and weight[k, c] <= 0:
                if count == 0:
                    begin = k
                count += 1
                continue
            for j in range(begin, k):
                if count > 0 and label[j, c] != 3:
                    label[j, c] = 1 if count <= longest_isolated else 2
            count = 0
            begin = k
    return label
