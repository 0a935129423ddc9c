"""The experiment of Zuo et al. 2021, sections 3.1 and 3.2: networks on both filters, four trials."""

from __future__ import annotations

import pytest

from tests.acceptance import zuo2021


@pytest.mark.parametrize("flight", zuo2021.SCENARIOS)
def test_below_the_paper_and_below_bpnn_ekf_in_each_trial(flight):
    scenario = zuo2021.SCENARIOS[flight]
    ours, theirs = (zuo2021.errors(method, scenario) for method in ("ga-bpnn-ukf", "bpnn-ekf"))
    for own, other, paper in zip(ours, theirs, zuo2021.PAPER["ga-bpnn-ukf"], strict=True):
        assert own < other
        assert own < paper


@pytest.mark.parametrize("scenario", zuo2021.SCENARIOS.values())
def test_the_network_does_no_harm(scenario):
    with_network, without = (zuo2021.errors("ga-bpnn-ukf", scenario, corrected) for corrected in (True, False))
    assert sum(with_network) <= 1.005 * sum(without)
