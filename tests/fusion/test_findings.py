"""What the verdict on a fused flight rests on, finding by finding."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from ftproc.fusion import findings


def flight(residual):
    """As much of a fused flight as its residuals (n,) of one azimuth need."""
    n = len(residual)
    three = np.full((n, 3), np.nan)
    three[:, 1] = residual
    run = SimpleNamespace(residual=three, residual_variance=np.full((n, 3), 4.0))
    station = SimpleNamespace(name="theodolite", components=[1])
    return SimpleNamespace(
        stations=[station],
        events=SimpleNamespace(of=lambda s, values: values),
        found=SimpleNamespace(run=run),
        weight=[np.where(np.isfinite(three), 1.0, 0.0)],
    )


@pytest.mark.parametrize("seed", range(5))
def test_white_residuals_are_no_finding(seed):
    rng = np.random.default_rng(seed)
    for n in (5, 12, 50, 3000):
        assert not list(findings._correlated(flight(2 * rng.standard_normal(n))))


def test_residuals_of_a_patch_that_is_believed_are_one():
    residual = np.random.default_rng(1).standard_normal(60)
    residual[20:40] += 5.0
    (found,) = findings._correlated(flight(residual))
    assert found.level == findings.SUSPECT
    assert "azimuth residuals of theodolite" in found.text
