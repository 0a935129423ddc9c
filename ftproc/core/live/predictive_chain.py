"""Outlier decisions on each reading as it comes, from its innovation: the forward half of the hidden Markov chain of
`outlier_chain`, inside a recursive filter.

Each component carries the probabilities that its next reading is good, an isolated outlier or part of a patch. The
innovation tells which it is; the reading is used if it is more likely good than not. Readings that are decided already
keep their weight, and the probabilities follow. A weight below zero (`OPEN`) is one that is yet to be decided.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import part, record, zeros
from ftproc.core.editing.outlier_chain import NATURAL_GATE, WIDE
from ftproc.core.filtering import ukf
from ftproc.core.filtering.filters import ColouredFilters, Filter
from ftproc.core.filtering.forward import recursion, store_innovation
from ftproc.core.filtering.records import Row, Sample
from ftproc.core.signatures import Layout

FloatArray = NDArray[np.float64]


OPEN = -1.0  # the weight of a reading that is not decided


class Chains(Protocol):
    """The record of the chains of range, azimuth and elevation.

    stretch: (gate / natural gate)^2. rates: (3, 3) isolated outlier, patch begins, patch goes on, by component. wide:
    (3,) variance that a bad reading has beyond the good ones'. ahead: (3, 3) probabilities of the next reading's state
    by component, negative before the first reading. good: (3,) probability that the last reading was good.
    """

    stretch: float
    rates: Annotated[FloatArray, 3, 3]
    wide: Annotated[FloatArray, 3]
    ahead: Annotated[FloatArray, 3, 3]
    good: Annotated[FloatArray, 3]


CHAINS = record(Chains)
ChainRecords = Annotated[Any, Layout(CHAINS)]


def chains_of(rates: FloatArray, reading_variance: FloatArray, gate: float) -> Any:
    """An array of one `Chains` that has seen nothing. rates (3, 3), reading_variance (3,), gate in sigmas."""
    chains = zeros(CHAINS)
    chains["stretch"], chains["rates"], chains["wide"] = (gate / NATURAL_GATE) ** 2, rates, WIDE**2 * reading_variance
    chains["ahead"], chains["good"] = -1.0, 1.0
    return chains


@part
def _transition(isolated: float, begins: float, stays: float, old: int, new: int) -> float:
    """Probability of a state after another: 0 good, 1 isolated outlier, 2 patch."""
    if old < 2:
        return 1 - isolated - begins if new == 0 else isolated if new == 1 else begins
    return (1 - stays) * (1 - isolated) if new == 0 else (1 - stays) * isolated if new == 1 else stays


@part
def _weigh(chains: Chains, i: int, innovation: float, variance: float) -> float:
    """Probability that a component's reading is good; the chain moves on to the next."""
    isolated, begins, stays = chains.rates[i, 0], chains.rates[i, 1], chains.rates[i, 2]
    ahead = chains.ahead
    if ahead[i, 0] < 0:
        for j in range(3):
            ahead[i, j] = _transition(isolated, begins, stays, 0, j)
    narrow = chains.stretch * variance
    wide = narrow + chains.wide[i]
    ratio = 0.5 * innovation * innovation * (1 / narrow - 1 / wide) - 0.5 * math.log(wide / narrow)
    likely0, likely1 = math.exp(min(0.0, -ratio)), math.exp(min(0.0, ratio))
    p0, p1, p2 = ahead[i, 0] * likely0 + 1e-300, ahead[i, 1] * likely1, ahead[i, 2] * likely1
    total = p0 + p1 + p2
    p0, p1, p2 = p0 / total, p1 / total, p2 / total
    for j in range(3):
        ahead[i, j] = (
            p0 * _transition(isolated, begins, stays, 0, j)
            + p1 * _transition(isolated, begins, stays, 1, j)
            + p2 * _transition(isolated, begins, stays, 2, j)
        )
    return float(p0)


@part
def _predictive(f: Filter, sample: Sample, records: ChainRecords, row: Row) -> tuple[float, bool]:
    """The update of a sample with the readings that are good, as far as is known by then."""
    chains = records[0]
    ukf.expect(f)
    ukf.innovate(sample, f)
    any_used = False
    for i in range(3):
        f.used[i] = 0.0
        if not math.isfinite(f.e[i]):
            continue
        good = _weigh(chains, i, f.e[i], f.c[i, i] + f.noise[i] + f.late[i] * f.late[i])
        chains.good[i] = good
        if sample.weight[i] > 0 or (sample.weight[i] < 0 and good > 0.5):
            f.used[i] = 1.0
            any_used = True
    store_innovation(f, row)
    if not any_used:
        return 0.0, False
    row.nis, gained = ukf.update(f)
    return gained, False


run_predictive = recursion(_predictive, ChainRecords)
run_predictive_coloured = recursion(_predictive, ChainRecords, ColouredFilters)
