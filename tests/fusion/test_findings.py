"""What the verdict on a fused flight rests on, finding by finding."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from ftproc.fusion import findings
from ftproc.records import COMPONENTS


def flight(residual):
    """As much of a fused flight as its residuals (n,) of one azimuth need."""
    n = len(residual)
    three = np.full((n, 3), np.nan)
    three[:, 1] = residual
    station = SimpleNamespace(name="theodolite", components=[1], names=COMPONENTS, away_m=0.0)
    return SimpleNamespace(
        stations=[station],
        residual=[three],
        residual_variance=[np.full((n, 3), 4.0)],
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


def seen_by(*components, interval_s=0.1, n=600):
    """As much of a fused flight of stations with these components as their decisions need; all readings are used."""
    possible = [np.isin(np.arange(3), each)[None] * np.ones((n, 1)) for each in components]
    stations = [
        SimpleNamespace(name=f"station {s}", components=each, names=COMPONENTS, time_s=interval_s * np.arange(n))
        for s, each in enumerate(components)
    ]
    constants = SimpleNamespace(estimate=np.zeros((len(stations), 6)))
    return SimpleNamespace(
        stations=stations, possible=possible, weight=[each.copy() for each in possible], constants=constants
    )


def test_what_is_left_of_two_theodolites_without_one_angle_checks_nothing():
    fused = seen_by((1, 2), (1, 2))
    assert not list(findings._unchecked(fused, 0.0))
    fused.weight[1][200:400, 1] = 0.0
    (found,) = findings._unchecked(fused, 100.0)
    assert found.level == findings.SUSPECT
    assert found.text.startswith("the azimuth of station 1 is rejected from 120 to 139.9 s")


def test_a_patch_or_another_station_or_none_left_is_no_such_finding():
    patch, third, elsewhere = seen_by((1, 2), (1, 2)), seen_by((1, 2), (1, 2), (0,)), seen_by((1, 2), (1, 2))
    patch.weight[1][200:280, 1] = 0.0
    third.weight[1][200:400, 1] = 0.0
    elsewhere.weight[1][200:400] = 0.0  # is named as another target
    assert not [text for each in (patch, third, elsewhere) for text in findings._unchecked(each, 0.0)]
