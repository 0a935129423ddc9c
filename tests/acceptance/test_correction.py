"""Where the network must help, and where it must not harm: the benchmark's cases on fewer flights, through `auto`."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from ftproc import pipeline
from ftproc.correction import model_file
from ftproc.settings import FilterSettings, TrainSettings
from ftproc.simulation import simulate
from tests.bench import correction
from tests.bench.correction import CASES, result

QUICK = TrainSettings(epochs=120, population=10, generations=10)


@pytest.mark.parametrize(("name", "bound"), [("a", 0.65), pytest.param("c", 0.95, marks=pytest.mark.slow)])
def test_a_filter_with_wrong_settings_is_corrected(name, bound):
    found = result(replace(CASES[name], training=14, duration_s=50.0), new=4, settings=QUICK)
    assert found.ratio() <= bound


def test_an_instrument_learned_from_two_calibration_flights_is_corrected_on_new_ones():
    found = result(replace(CASES["calibration"], training=2), new=2, settings=QUICK)
    assert found.ratio() <= 0.5
    assert found.ratio("smoother position") <= 0.5


def test_servo_circles_and_range_walk_are_learned(monkeypatch):
    monkeypatch.setattr(correction, "flights", cache(correction.flights))
    case = replace(CASES["all"], training=14, duration_s=50.0)
    ratios = [result(case, new=3, settings=replace(QUICK, seed=seed)).ratio("smoother position") for seed in range(2)]
    assert max(ratios) <= 0.4
    assert max(ratios) / min(ratios) <= 1.2


@pytest.mark.slow
def test_a_repeatable_elevation_bias_is_taken_out_of_filter_and_smoother():
    found = result(replace(CASES["b"], training=8, duration_s=60.0), new=3, settings=QUICK)
    assert {s.features.name for s in found.model.stages.values()} == {"instrument"}
    assert found.ratio() <= 0.6
    assert found.ratio("smoother position") <= 0.6


def test_a_filter_with_right_settings_is_not_harmed():
    found = result(replace(CASES["matched"], training=4, duration_s=40.0), new=2, settings=QUICK)
    for what, squares in found.squares.items():
        assert found.ratio(what) <= 1.005
        assert (squares[:, 0] <= 1.01**2 * squares[:, 1]).all()


def test_the_packaged_network_takes_out_the_lag_of_the_filter_on_flights_it_has_not_seen():
    """Flights of its family with other seeds than it was trained on; none may get worse."""
    model, ratios = model_file.named("packaged"), []
    for seed in range(7000, 7008):
        flight = simulate("family", seed=seed, duration_s=60.0)
        plain, corrected = (pipeline.filter_log(flight.log, model=each) for each in (None, model))
        away = [np.linalg.norm(t.state[:, :3] - flight.truth.position_m, axis=1) for t in (corrected, plain)]
        ratios.append(np.sqrt(np.mean(away[0] ** 2) / np.mean(away[1] ** 2)))
    assert max(ratios) <= 1.005
    assert np.median(ratios) <= 0.97


@pytest.mark.parametrize(
    ("settings", "why"),
    [
        (FilterSettings(editing="live", lag_s=1.0), "there is no smoother of this run that could prove it"),
        (FilterSettings(smooth=True), "gain 0"),
        (FilterSettings(editing="none"), "there is no smoother of this run that could prove it"),
    ],
)
def test_where_a_flight_cannot_prove_it_nothing_is_corrected_and_the_summary_says_why(settings, why):
    flight = simulate("manoeuvre-clean", seed=3, duration_s=20.0)
    found = pipeline.filter_log(flight.log, settings, model_file.named("packaged"))
    assert not found.correction.any()
    assert why in found.metadata["summary"]["network"]
    assert "corrects the filter only" not in " ".join(found.metadata["summary"]["trust"]["reasons"])
