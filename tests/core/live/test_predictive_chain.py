"""Decisions on readings as they come: the forward half of the hidden Markov chain, by matrices."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.editing.outlier_chain import NATURAL_GATE, WIDE
from ftproc.core.filtering.forward import Span
from ftproc.core.filtering.records import empty_rows
from ftproc.core.live.predictive_chain import OPEN, chains_of, run_predictive
from tests.core.tracks import SIGMA, matched

RATES = np.array([[0.02, 0.001, 0.92], [0.1, 0.01, 0.7], [0.005, 0.02, 0.98]])
BAD = {0: slice(40, 52), 1: slice(20, 90, 9), 2: slice(70, 74)}


def flight(seed):
    """Patches and isolated outliers, readings that are missing, and some that are decided, rightly or not."""
    a = matched(seed, 120, q=5.0, missing=0.05)
    z = a.z.copy()
    for c, rows in BAD.items():
        z[rows, c] += 30 * SIGMA[c]
    weight = np.where(np.isfinite(z), OPEN, 0.0)
    weight[:10] = weight[60:65] = np.isfinite(z)[:1]
    weight[100:103] = 0.0
    return a._replace(z=z, weight=weight)


def run(a, gate, rows=slice(0, 120), filters=None, chains=None):
    filters = a.model.filter(a.starts[0]) if filters is None else filters
    chains = chains_of(RATES, a.model.reading_variance, gate) if chains is None else chains
    found = empty_rows(len(a.time))
    samples, profile = a.log.samples(a.model.noise_variance), a.model.profile(a.time)
    run_predictive(Span(rows.start, rows.stop, 0), samples, profile, filters, chains, found)
    return found, filters, chains


def probabilities(innovation, variance, rates, noise, gate):
    """(n,) of being good given all up to then, and (3,) of the states ahead, of one component."""
    isolated, begins, stays = rates
    step = np.array([[1 - isolated - begins, isolated, begins]] * 2 + [[0.0] * 3])
    step[2] = (1 - stays) * (1 - isolated), (1 - stays) * isolated, stays
    ahead, good = step[0], np.full(len(innovation), np.nan)
    for k in np.flatnonzero(np.isfinite(innovation)):
        narrow = variance[k] * (gate / NATURAL_GATE) ** 2
        spread = np.array([narrow, *[narrow + WIDE**2 * noise] * 2])
        now = ahead * np.exp(-0.5 * innovation[k] ** 2 / spread) / np.sqrt(spread)
        now /= now.sum()
        good[k], ahead = now[0], now @ step
    return good, ahead


@pytest.mark.parametrize("gate", [3.0, 4.0, 6.0])
@pytest.mark.parametrize("seed", range(3))
def test_a_reading_is_used_if_it_is_likelier_good_than_not_by_what_came_before(seed, gate):
    a = flight(seed)
    found, _, chains = run(a, gate)
    for c in range(3):
        innovation, variance = found["innovation"][:, c], found["innovation_sigma"][:, c] ** 2
        good, ahead = probabilities(innovation, variance, RATES[c], a.model.reading_variance[c], gate)
        likely = np.where(a.weight[:, c] == OPEN, good > 0.5, a.weight[:, c] > 0) & np.isfinite(a.z[:, c])
        np.testing.assert_array_equal(found["weight"][:, c] > 0, likely)
        np.testing.assert_allclose(chains["ahead"][0, c], ahead, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(chains["good"][0, c], good[np.isfinite(good)][-1], rtol=1e-9, atol=1e-12)


def test_outliers_are_left_out_and_the_others_used():
    a = flight(4)
    weight = run(a, 4.0)[0]["weight"]
    bad = np.zeros(a.z.shape, bool)
    for c, rows in BAD.items():
        bad[rows, c] = True
    there = (a.weight == OPEN) & np.isfinite(a.z)
    assert not weight[there & bad].any()
    assert (weight[there & ~bad] > 0).mean() > 0.97


def test_in_pieces_it_is_what_it_is_in_one():
    a = flight(5)
    whole, *_ = run(a, 4.0)
    first, filters, chains = run(a, 4.0, slice(0, 47))
    second, *_ = run(a, 4.0, slice(47, 120), filters, chains)
    for name in ("state", "weight", "innovation"):
        np.testing.assert_array_equal(np.concatenate([first[name][:47], second[name][47:]]), whole[name])
