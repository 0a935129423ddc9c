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
ROUNDS, STILL = 3, 0.01  # of estimating the rates; share of a rate by which it may yet change, to stand still


@part
def _likely(residual: Matrix, variance: Matrix, c: int, noise: float, stretch: float, likely: FloatArray) -> None:
    """Fill likely (n, 2): how likely the residual of component c is of a good reading and of a bad one, against the
    likelier of the two; -1 where it is missing."""
    for k in range(len(likely)):
        r, v = residual[k, c], variance[k, c]
        if not math.isfinite(r):
            likely[k, 0] = -1.0
            continue
        narrow = stretch * v
        wide = narrow + WIDE * WIDE * noise
        ratio = 0.5 * r**2 * (1 / narrow - 1 / wide) - 0.5 * math.log(wide / narrow)
        less = math.exp(-abs(ratio))
        likely[k, 0] = less if ratio > 0 else 1.0
        likely[k, 1] = 1.0 if ratio > 0 else less


@part
def _chain(
    likely: FloatArray, filtered: FloatArray, rates: FloatArray, good: FloatArray, c: int, counts: FloatArray
) -> None:
    """Forward-backward recursion: fills good (n, 3) of component c with P(good | all), zero where missing, and the
    expected number of transitions, counts (5,): to isolated outliers and to patches, and all, of readings outside
    patches; within patches, and all, of those inside. filtered: (n, 3), to work in.

    What follows a good reading and what follows an isolated outlier is the same.
    """
    isolated, begins, stays = rates
    fine = 1 - isolated - begins
    ends_fine, ends_isolated = (1 - stays) * (1 - isolated), (1 - stays) * isolated
    ahead0, ahead1, ahead2 = fine, isolated, begins
    for k in range(len(likely)):
        if likely[k, 0] < 0:
            continue
        f0, f1, f2 = ahead0 * likely[k, 0] + 1e-300, ahead1 * likely[k, 1] + 1e-300, ahead2 * likely[k, 1] + 1e-300
        share = 1 / (f0 + f1 + f2)
        f0, f1, f2 = f0 * share, f1 * share, f2 * share
        filtered[k, 0], filtered[k, 1], filtered[k, 2] = f0, f1, f2
        outside = f0 + f1
        ahead0 = outside * fine + f2 * ends_fine
        ahead1 = outside * isolated + f2 * ends_isolated
        ahead2 = outside * begins + f2 * stays
    counts[:] = 0.0
    later0 = later1 = later2 = -1.0  # how likely each state makes the readings after it, times that of the next one
    for k in range(len(likely) - 1, -1, -1):
        good[k, c] = 0.0
        if likely[k, 0] < 0:
            continue
        f0, f1, f2 = filtered[k, 0], filtered[k, 1], filtered[k, 2]
        outside, inside = 1.0, 1.0
        if later0 >= 0:
            outside = fine * later0 + isolated * later1 + begins * later2
            inside = ends_fine * later0 + ends_isolated * later1 + stays * later2
            share = 1 / max((f0 + f1) * outside + f2 * inside, 1e-300)
            counts[0] += share * (f0 + f1) * isolated * later1
            counts[1] += share * (f0 + f1) * begins * later2
            counts[2] += share * (f0 + f1) * outside
            counts[3] += share * f2 * stays * later2
            counts[4] += share * f2 * inside
            share = 1 / (outside + inside)
            outside, inside = outside * share, inside * share
        good[k, c] = f0 * outside / max((f0 + f1) * outside + f2 * inside, 1e-300)
        later0, later1, later2 = likely[k, 0] * outside, likely[k, 1] * outside, likely[k, 1] * inside


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
