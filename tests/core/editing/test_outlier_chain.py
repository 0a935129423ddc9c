"""The hidden Markov chain against the sum over all sequences, and the labels of runs."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.editing import outlier_chain
from tests import naive

NAN = np.nan


def enumerated(residual, variance, noise, gate, rates):
    """P(good) of one component and its rates after up to three rounds of learning, by the sum over all sequences."""
    seen = np.isfinite(residual)
    r, v = residual[seen], variance[seen] * (gate / outlier_chain.NATURAL_GATE) ** 2
    wide = v + outlier_chain.WIDE**2 * noise
    good = np.exp(-0.5 * r * r / v) / np.sqrt(v)
    bad = np.exp(-0.5 * r * r / wide) / np.sqrt(wide)
    for _ in range(outlier_chain.ROUNDS):
        isolated, begins, stays = rates
        step = np.array([[1 - isolated - begins, isolated, begins]] * 2 + [[0.0] * 3])
        step[2] = (1 - stays) * (1 - isolated), (1 - stays) * isolated, stays
        p, counts = naive.chain(good, bad, step)
        outside, most, prior = counts[:2].sum(), outlier_chain.MAX_RATES, outlier_chain.PRIOR_SAMPLES
        stays = (counts[2, 2] + outlier_chain.START_RATES[2] * prior) / (counts[2].sum() + prior)
        before, rates = (
            rates,
            (
                min((counts[:2, 1].sum() + 0.005 * prior) / (outside + prior), most[0]),
                min((counts[:2, 2].sum() + 0.0005 * prior) / (outside + prior), most[1]),
                np.clip(stays, outlier_chain.MIN_STAY, most[2]),
            ),
        )
        if np.allclose(rates, before, rtol=outlier_chain.STILL, atol=0):
            break
    found = np.zeros(len(residual))
    found[seen] = p
    return found, np.array(rates)


@pytest.mark.parametrize("gate", [3.0, 4.0, 6.0])
@pytest.mark.parametrize("seed", range(3))
def test_chain_is_the_sum_over_all_sequences(seed, gate):
    rng = np.random.default_rng(seed)
    noise = np.array([4.0, 1e-6, 0.25])
    variance = noise * rng.uniform(1.01, 3, (7, 3))
    residual = np.sqrt(variance) * rng.standard_normal((7, 3)) * rng.choice([1.0, 3.0, 10.0], (7, 3))
    residual[2:5, 0] += 12.0
    residual[rng.random((7, 3)) < 0.15] = NAN
    rates = np.tile(np.array(outlier_chain.START_RATES), (3, 1))
    good = outlier_chain.classify(residual, variance, noise, rates, gate)
    for c in range(3):
        expected, learnt = enumerated(residual[:, c], variance[:, c], noise[c], gate, outlier_chain.START_RATES)
        np.testing.assert_allclose(good[:, c], expected, atol=1e-12)
        np.testing.assert_allclose(rates[c], learnt, rtol=1e-10)


def classified(t, gate=4.0):
    """P(good) of residuals in sigmas, known almost exactly."""
    residual = np.tile(np.asarray(t, float)[:, None], (1, 3))
    rates = np.tile(np.array(outlier_chain.START_RATES), (3, 1))
    return outlier_chain.classify(residual, np.full_like(residual, 1.01), np.ones(3), rates, gate)[:, 0], rates


@pytest.mark.parametrize(("size", "good"), [(0.0, True), (3.0, True), (3.5, True), (5.0, False), (50.0, False)])
def test_lone_reading_is_given_up_about_the_gate(size, good):
    t = np.zeros(200)
    t[100] = size
    assert (classified(t)[0][100] > 0.5) == good
    assert (np.delete(classified(t)[0], 100) > 0.9).all()


@pytest.mark.parametrize("gate", [2.5, 3.0, 3.5, 4.0, 6.0])
def test_clean_residuals_are_good_whatever_the_gate(gate):
    good = classified(np.random.default_rng(2).standard_normal(2000), gate)[0]
    assert (good > 0.5).mean() > 0.97


@pytest.mark.parametrize("size", [3.6, 4.6, 5.5])
def test_wider_gate_keeps_more(size):
    t = np.zeros(200)
    t[100] = size
    assert classified(t, gate=3.0)[0][100] < classified(t, gate=4.0)[0][100] < classified(t, gate=6.0)[0][100]


def test_small_members_of_a_patch_are_found_by_their_neighbours():
    t = np.zeros(200)
    t[100:112] = 9.0
    t[105] = 2.5
    good = classified(t)[0]
    assert good[105] < 0.5
    assert (good[100:112] < 0.5).all()
    alone = np.zeros(200)
    alone[105] = 2.5
    assert classified(alone)[0][105] > 0.9


def test_good_readings_between_two_spikes_are_no_patch():
    t = np.zeros(200)
    t[[100, 110]] = 40.0
    assert (classified(t)[0][101:110] > 0.9).all()


def test_even_residuals_of_infinity_have_a_verdict():
    t = np.zeros(50)
    t[20:25] = 1e9
    good = classified(t)[0]
    assert np.isfinite(good).all()
    assert (good[20:25] < 1e-6).all()


def test_rates_follow_the_log_within_their_bounds():
    rng = np.random.default_rng(1)
    t = rng.standard_normal(3000)
    t[rng.random(3000) < 0.2] = 60.0
    good, rates = classified(t)
    assert rates[0, 0] == pytest.approx(0.2, abs=0.04)
    assert (good < 0.5).mean() == pytest.approx(0.2, abs=0.02)
    clean_rates = classified(rng.standard_normal(3000))[1]
    assert clean_rates[0, 0] < 0.005
    assert (rates <= outlier_chain.MAX_RATES).all()


def labels(text):
    """'.' a good reading, 'x' a rejected one, '?' a missing one -> their labels, as one string."""
    weight = np.array([[float(c == ".")] * 3 for c in text])
    measurement = np.array([[NAN if c == "?" else 1.0] * 3 for c in text])
    label = outlier_chain.label_runs(weight, measurement, 2)
    assert (label == label[:, :1]).all()
    return "".join(str(int(v)) for v in label[:, 0])


@pytest.mark.parametrize(
    ("text", "label"),
    [
        ("......", "000000"),
        ("..x...", "001000"),
        ("..xx..", "001100"),
        (".xxx..", "022200"),
        ("x.xx.x", "101101"),
        ("xxxxxx", "222222"),
        ("x?x...", "131000"),
        ("x?xx..", "232200"),
        ("xx??x.", "223320"),
        ("?x?...", "313000"),
        ("......?", "0000003"),
        ("...xxx?", "0002223"),
        ("xx.x.xx", "1101011"),
        ("xxx.xx", "222011"),
        ("???", "333"),
        ("x", "1"),
    ],
)
def test_label_runs(text, label):
    """Runs of at most two rejections are isolated, longer ones patches; missing readings do not break a run."""
    assert labels(text) == label


def test_components_are_labelled_each_by_itself():
    weight = np.ones((6, 3))
    weight[1:5, 0] = 0
    weight[2, 1] = 0
    label = outlier_chain.label_runs(weight, np.ones((6, 3)), 2)
    np.testing.assert_array_equal(label.T, [[0, 2, 2, 2, 2, 0], [0, 0, 1, 0, 0, 0], [0] * 6])


@pytest.mark.parametrize("bad", ["none", "one", "block", "all"])
def test_long_chains_lose_no_digits(bad):
    """Probabilities that are never normalised become small; against a recursion that divides at every reading."""
    rng = np.random.default_rng(5)
    n, sigma = 3000, 1.01
    t = rng.standard_normal(n)
    t[{"none": slice(0), "one": slice(77, 78), "block": slice(1000, 1400), "all": slice(n)}[bad]] *= 1e4
    narrow, wide = sigma, sigma + outlier_chain.WIDE**2
    log_good = -0.5 * t * t * (1 / narrow - 1 / wide) + 0.5 * np.log(wide / narrow)
    likely = np.exp(np.stack([np.minimum(log_good, 0), np.minimum(-log_good, 0)], 1))[:, [0, 1, 1]]
    isolated, begins, stays = outlier_chain.START_RATES
    step = np.array([[1 - isolated - begins, isolated, begins]] * 2 + [[(1 - stays) * (1 - isolated)] * 3])
    step[2] = (1 - stays) * (1 - isolated), (1 - stays) * isolated, stays
    ahead, forward, later = step[0], np.zeros((n, 3)), np.ones(3)
    for k in range(n):
        forward[k] = ahead * likely[k] / (ahead * likely[k]).sum()
        ahead = forward[k] @ step
    good = np.zeros(n)
    for k in range(n - 1, -1, -1):
        good[k] = forward[k, 0] * later[0] / (forward[k] @ later)
        later = step @ (likely[k] * later)
        later /= later.sum()
    filtered, found, counts = np.zeros((n, 3)), np.zeros((n, 3)), np.zeros(5)
    residual, variance, ours = np.tile(t[:, None], (1, 3)), np.full((n, 3), sigma), np.zeros((n, 2))
    outlier_chain._likely(residual, variance, 0, 1.0, 1.0, ours)
    outlier_chain._chain(ours, filtered, np.array(outlier_chain.START_RATES), found, 0, counts)
    np.testing.assert_allclose(found[:, 0], good, rtol=1e-9, atol=1e-12)
    assert counts[2] + counts[4] == pytest.approx(n - 1)
