"""Steps that stand out: where neighbours are merged, the same ones at the same places."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.filtering.records import Observations
from ftproc.core.identification import decimation
from ftproc.core.identification.standing_out import standing_out
from tests.core.tracks import SIGMA, matched

pytestmark = pytest.mark.compiled

N, APART = 4000, 100


@pytest.mark.parametrize("size", [5.0, 20.0])
def test_dense_readings_tell_of_the_same_steps(size, monkeypatch):
    a = matched(1, N, dt=0.02, q=1.0, distance=7000.0)
    z = a.z.copy()
    places = {0: 1003, 1: 2001, 2: 3002}  # whatever groups begin with
    for c, k in places.items():
        z[k:, c] += size * SIGMA[c]
    log = Observations(a.time, z, np.ones((N, 3)))
    merging = []
    monkeypatch.setattr(decimation, "merge", lambda *each, merge=decimation.merge: merging.append(1) or merge(*each))
    merged = standing_out(log, a.model, APART)
    assert merging
    monkeypatch.setattr(decimation, "MOST", 1)
    one_by_one = standing_out(log, a.model, APART)
    for found in (merged, one_by_one):
        for c, k in places.items():
            (step,) = [step for step in found if step.component == c and abs(step.sample - k) < 50]
            assert abs(step.sample - k) <= 1 + 10 / size
            assert step.size == pytest.approx(size * SIGMA[c], abs=5 * step.sigma)


def test_nothing_stands_out_of_a_flight_that_obeys_the_model():
    a = matched(2, N, dt=0.02, q=1.0, distance=7000.0)
    assert standing_out(Observations(a.time, a.z, np.ones((N, 3))), a.model, APART) == []
