"""Spans between starts."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.filtering.forward import filter_log
from ftproc.core.filtering.records import Model, Sites, Start, Uneven, between
from ftproc.core.filtering.smoother import smooth_log
from tests.core.tracks import matched


def starts_at(*samples):
    return [Start(sample, np.full(9, float(number)), np.eye(9)) for number, sample in enumerate(samples)]


@pytest.mark.parametrize(
    ("samples", "spans"),
    [
        ((0,), [(0, 0, 10)]),
        ((3, 7), [(0, 3, 7), (1, 7, 10)]),
        ((3, 3, 7), [(1, 3, 7), (2, 7, 10)]),  # of two at one sample the last one counts
        ((0, 0, 0), [(2, 0, 10)]),
        ((0, 10), [(0, 0, 10)]),  # nothing follows a start at the end of the log
        ((0, 4, 4, 10, 10), [(0, 0, 4), (2, 4, 10)]),
    ],
)
def test_a_span_reaches_from_a_start_to_the_next_and_empty_ones_are_passed_over(samples, spans):
    found = [(int(start.state[0]), start.sample, stop) for start, stop in between(starts_at(*samples), 10)]
    assert found == spans


def test_passes_over_a_log_with_two_starts_at_one_sample():
    a = matched(3, 60)
    (first,) = a.starts
    wrong = first._replace(state=first.state + 1e3)
    later = first._replace(sample=30, state=a.truth[30])
    once, twice = [first, later], [wrong, first, later, later._replace(sample=60)]
    for one, two in (
        (smooth_log(a.log, a.model, once), smooth_log(a.log, a.model, twice)),
        (filter_log(a.log, a.model, once), filter_log(a.log, a.model, twice)),
    ):
        np.testing.assert_array_equal(two.state, one.state)
        assert two.log_likelihood == one.log_likelihood


def test_samples_carry_the_noise_of_each_reading():
    a = matched(1, 3)
    noise = np.array([4.0, 1e-6, 9e-6])
    assert (a.log.samples(noise)["noise"] == noise).all()
    assert not a.log.samples(noise)["late"].any()
    times, late = np.arange(1.0, 10).reshape(3, 3), np.arange(9.0).reshape(3, 3)
    samples = a.log._replace(uneven=Uneven(times, late)).samples(noise)
    np.testing.assert_array_equal(samples["noise"], times * noise)
    np.testing.assert_array_equal(samples["late"], late)


@pytest.mark.parametrize("rows", [slice(2, 7), np.array([0, 3, 8])])
def test_a_part_of_a_log_keeps_what_belongs_to_its_samples(rows):
    """How the noise of its readings differs, and the stations that took them."""
    a, noise = matched(1, 10), np.array([4.0, 1e-6, 9e-6]) * np.array([[1.0], [2.0]])
    uneven = Uneven(np.arange(1.0, 31).reshape(10, 3), np.arange(30.0).reshape(10, 3))
    sites = Sites(np.arange(10) % 2, np.array([[0.0, 0, 0], [1, 2, 3]]), np.tile(np.eye(3), (2, 1, 1)), np.ones(2))
    log = a.log._replace(uneven=uneven, sites=sites)
    np.testing.assert_array_equal(log.part(rows).samples(noise), log.samples(noise)[rows])


def test_correlation_fades_with_the_interval():
    """From the share of the correlated noise in all of it; to 1/e of that after the time in which it fades."""
    model = Model(
        np.array([1.0, 2.0, 4.0]), np.zeros((1, 6)), 1.0, np.array([3.0, 0.0, 4.0]), np.array([0.5, 1.0, 2.0])
    )
    share = np.array([0.75, 0.0, 0.5])
    np.testing.assert_allclose(model.correlation(0.0), share)
    np.testing.assert_allclose(model.correlation(0.5), share * np.exp([-1.0, -0.5, -0.25]))
