"""Where the network must help, and where it must not harm: the benchmark's cases on fewer flights, through `auto`."""

from __future__ import annotations

from dataclasses import replace

import pytest

from ftproc.settings import TrainSettings
from tests.bench.correction import CASES, result

QUICK = TrainSettings(epochs=120, population=10, generations=10)


@pytest.mark.parametrize(("name", "bound"), [("a", 0.65), ("c", 0.95)])
def test_a_filter_with_wrong_settings_is_corrected(name, bound):
    found = result(replace(CASES[name], training=14, duration_s=50.0), new=4, settings=QUICK)
    assert found.ratio() <= bound


def test_an_instrument_learned_from_two_calibration_flights_is_corrected_on_new_ones():
    found = result(replace(CASES["calibration"], training=2), new=2, settings=QUICK)
    assert found.ratio() <= 0.5
    assert found.ratio("smoother position") <= 0.5


def test_a_repeatable_elevation_bias_is_taken_out_of_filter_and_smoother():
    found = result(replace(CASES["b"], training=8, duration_s=60.0), new=3, settings=QUICK)
    assert {s.features.name for s in found.model.stages.values()} == {"instrument"}
    assert found.ratio() <= 0.6
    assert found.ratio("smoother position") <= 0.6


def test_a_filter_with_right_settings_is_not_harmed():
    found = result(replace(CASES["matched"], training=8, duration_s=60.0), new=3, settings=QUICK)
    for what, squares in found.squares.items():
        assert found.ratio(what) <= 1.005
        assert (squares[:, 0] <= 1.01**2 * squares[:, 1]).all()
