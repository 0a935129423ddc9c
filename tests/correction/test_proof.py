"""What a flight's own smoother proves of a correction."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.correction.features import LineOfSight
from ftproc.correction.proof import FEWEST, own_gain
from ftproc.records import FloatArray
from tests.correction import fake

N = 600


def gain(output: FloatArray, wanted: FloatArray) -> FloatArray:
    """own_gain of outputs (n, 6) where the smoother is `wanted` (n, 6) sigmas away."""
    run = fake.run(np.random.default_rng(0), len(output))
    los = LineOfSight.of(run, 0, len(output))
    return own_gain(los, output, los.to_cartesian(wanted * los.sigma), run.time_s, np.ones(len(output), bool))


@pytest.mark.parametrize("share", [0.3, 1.0, 2.0])
def test_what_leads_to_the_smoother_is_proven_up_to_the_whole_of_it(share: float) -> None:
    rng = np.random.default_rng(1)
    output = rng.normal(size=(N, 6))
    assert gain(output, share * output + rng.normal(size=(N, 6))) == pytest.approx(
        np.full(6, min(share, 1.0)), abs=0.15
    )


def test_chance_proves_little() -> None:
    """Of outputs that have nothing to do with the flight few are applied, and those by little."""
    rng = np.random.default_rng(2)
    found = np.array([gain(rng.normal(size=(N, 6)), rng.normal(size=(N, 6))) for _ in range(100)])
    assert (found > 0).mean() < 0.2
    assert found.max() < 0.2


def test_one_part_of_the_flight_proves_nothing_of_the_rest() -> None:
    rng = np.random.default_rng(3)
    output, wanted = rng.normal(size=(N, 6)), -0.1 * rng.normal(size=(N, 6))
    wanted[:40] += 2 * output[:40]
    assert not gain(output, wanted).any()


def test_each_output_is_proven_by_itself() -> None:
    rng = np.random.default_rng(4)
    output = rng.normal(size=(N, 6))
    wanted = output * (1, -1, 1, -1, 1, -1)
    assert (gain(output, wanted) > 0).tolist() == [True, False] * 3


def test_few_samples_or_none_that_the_smoother_knows_prove_nothing() -> None:
    output = np.ones((N, 6))
    assert not gain(output[: FEWEST - 1], output[: FEWEST - 1]).any()
    wanted = output.copy()
    wanted[FEWEST - 1 :] = np.nan
    assert not gain(output, wanted).any()
    assert not gain(np.zeros((N, 6)), output).any()
