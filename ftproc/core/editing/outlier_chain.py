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
BLOCK, SMALL = 16, 1e-30  # readings, after which a probability that is smaller is made larger
ROUNDS, STILL = 3, 0.01  # of estimating the rates; share of a rate by which it may yet change, to stand still


@part
def _likely(residual: Matrix, variance: Matrix, c: int, noise: float, stretch: float, likely: FloatArray) -> None:
    """Fill likely (n, 2): how likely the residual of component c is of a good reading and of a bad one, against the
    likelier of the two; -1 where it is missing."""
    for k in range(len(likely)):
        r, narrow = residual[k, c], stretch * variance[k, c]
        if not math.isfinite(r):
            likely[k, 0] = -1.0
            continue
        wide = narrow + WIDE * WIDE * noise
        good = math.exp(-0.5 * r * r * (1 / narrow - 1 / wide)) * math.sqrt(wide / narrow)  # times as likely as bad
        likely[k, 0] = good if good < 1 else 1.0
        likely[k, 1] = 1.0 if good < 1 else 1 / good


@part
def _chain(
    likely: FloatArray, filtered: FloatArray, rates: FloatArray, good: FloatArray, c: int, counts: FloatArray
) -> None:
    """Forward-backward recursion: fills good (n, 3) of component c with P(good | all), zero where missing, and the
    expected number of transitions, counts (5,): to isolated outliers and to patches, and all, of readings outside
    patches; within patches, and all, of those inside. filtered: (n, 3), to work in.

    What follows a good reading and what follows an isolated outlier is the same. Only ratios count, so that neither
    recursion has to divide; after a block, numbers that have become small are made larger.
    """
    isolated, begins, stays = rates
    fine = 1 - isolated - begins
    ends_fine, ends_isolated = (1 - stays) * (1 - isolated), (1 - stays) * isolated
    n = len(likely)
    ahead0, ahead1, ahead2 = fine, isolated, begins
    for low in range(0, n, BLOCK):
        for k in range(low, min(low + BLOCK, n)):
            if likely[k, 0] < 0:
                continue
            f0, f1, f2 = ahead0 * likely[k, 0] + 1e-300, ahead1 * likely[k, 1] + 1e-300, ahead2 * likely[k, 1] + 1e-300
            filtered[k, 0], filtered[k, 1], filtered[k, 2] = f0, f1, f2
            outside = f0 + f1
            ahead0 = outside * fine + f2 * ends_fine
            ahead1 = outside * isolated + f2 * ends_isolated
            ahead2 = outside * begins + f2 * stays
        if ahead0 + ahead1 + ahead2 < SMALL:
            ahead0, ahead1, ahead2 = ahead0 / SMALL, ahead1 / SMALL, ahead2 / SMALL
    counts[:] = 0.0
    later0 = later1 = later2 = 1.0  # how likely each state makes the readings after it, times that of the next one
    follows = 0.0  # readings after the first that is seen on the way back
    for high in range(n, 0, -BLOCK):
        for k in range(high - 1, max(high - BLOCK, 0) - 1, -1):
            good[k, c] = 0.0
            if likely[k, 0] < 0:
                continue
            f0, f1, f2 = filtered[k, 0], filtered[k, 1], filtered[k, 2]
            outside = fine * later0 + isolated * later1 + begins * later2
            inside = ends_fine * later0 + ends_isolated * later1 + stays * later2
            share = 1 / max((f0 + f1) * outside + f2 * inside, 1e-300)
            good[k, c] = f0 * outside * share
            share *= follows
            counts[0] += share * (f0 + f1) * isolated * later1
            counts[1] += share * (f0 + f1) * begins * later2
            counts[2] += share * (f0 + f1) * outside
            counts[3] += share * f2 * stays * later2
            counts[4] += share * f2 * inside
            later0, later1, later2 = likely[k, 0] * outside, likely[k, 1] * outside, likely[k, 1] * inside
            follows = 1.0
        if later0 + later1 + later2 < SMALL:
            later0, later1, later2 = later0 / SMALL, later1 / SMALL, later2 / SMALL


@part
def _estimate_rates(counts: FloatArray, rates: FloatArray) -> bool:
    """Baum-Welch update of the rates, towards rare outliers where the log says little; whether they stand still."""
    isolated = (counts[0] + 0.005 * PRIOR_SAMPLES) / (counts[2] + PRIOR_SAMPLES)
    begins = (counts[1] + 0.0005 * PRIOR_SAMPLES) / (counts[2] + PRIOR_SAMPLES)
    stays = (counts[3] + START_RATES[2] * PRIOR_SAMPLES) / (counts[4] + PRIOR_SAMPLES)
    still = True
    found = (min(isolated, MAX_RATES[0]), min(begins, MAX_RATES[1]), min(max(stays, MIN_STAY), MAX_RATES[2]))
    for i in range(3):
        still = still and abs(found[i] - rates[i]) < STILL * rates[i]
        rates[i] = found[i]
    return bool(still)


@kernel
def classify(residual: Matrix, variance: Matrix, noise_variance: Vector, rates: Matrix, gate: float) -> Matrix:
    """(n, 3) probability that each reading is good; zero where missing. `rates` (3, 3) are estimated in place.

    residual, variance: (n, 3) leave-one-out, from the smoother; noise_variance (3,). gate: sigmas.
    """
    stretch = (gate / NATURAL_GATE) ** 2
    n = residual.shape[0]
    good, counts, likely, filtered = np.empty((n, 3)), np.empty(5), np.empty((n, 2)), np.empty((n, 3))
    for c in range(3):
        _likely(residual, variance, c, noise_variance[c], stretch, likely)
        for _ in range(ROUNDS):
            _chain(likely, filtered, rates[c], good, c, counts)
            if _estimate_rates(counts, rates[c]):
                break
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
