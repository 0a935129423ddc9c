"""What a correction is trained from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ftproc.correction import model_file, network
from ftproc.correction.training.flights import filtered_flights, train_flights
from ftproc.correction.training.train import train
from ftproc.errors import InputError, UsageError
from ftproc.records import Truth
from ftproc.settings import FilterSettings, TrainSettings
from tests.correction import fake
from tests.simulated import simulate


def test_refuses_what_it_cannot_learn_from():
    flight, settings = simulate("cruise", seed=1, duration_s=40.0), TrainSettings()
    z = flight.log.measurement.copy()
    z[:, :2] = np.nan
    with pytest.raises(UsageError, match=r"^ukf takes no correction, so there is nothing to train for it$"):
        train_flights([(flight.log, flight.truth)], replace(settings, method="ukf"))
    with pytest.raises(InputError, match="range and azimuth missing throughout; training needs all three components"):
        train_flights([(replace(flight.log, measurement=z), flight.truth)], settings)
    late = Truth("late.csv", flight.truth.time_s + 1e4, flight.truth.position_m)
    with pytest.raises(InputError, match=r"^late\.csv: its times do not overlap those of "):
        train_flights([(flight.log, late)], settings)
    other = simulate("cruise", seed=2, duration_s=40.0).truth
    with pytest.raises(InputError, match=r"the truth of another flight.* Nothing is learned from it\.$"):
        train_flights([(flight.log, other)], settings)
    utc = replace(flight.truth, time_s=flight.truth.time_s + 18.0)
    with pytest.raises(InputError, match=r"it is 18 s \(GPS against UTC\) ahead"):
        train_flights([(flight.log, utc)], settings)


def test_of_live_editing_the_filter_alone_is_corrected():
    flight = simulate("manoeuvre", seed=1, dt_s=0.5, duration_s=100.0)
    settings = TrainSettings(population=2, generations=0, epochs=5)
    model = train_flights([(flight.log, flight.truth)], settings, FilterSettings(editing="live", lag_s=1.0))
    assert model.smoother is None
    assert model.settings["editing"] == "live"
    assert model.settings["lag_s"] == 1.0


def test_without_truth_the_smoother_is_the_teacher():
    flown = [simulate("manoeuvre-clean", seed=seed, dt_s=0.2, duration_s=100.0) for seed in range(2)]
    found = filtered_flights([(flight.log, None) for flight in flown])
    assert list(found) == ["filter"]
    for flight in found["filter"]:
        np.testing.assert_array_equal(flight.truth_position, flight.smoothed[:, :3])
        np.testing.assert_allclose(flight.error[:, 3:6], flight.smoothed[:, 3:6] - flight.run.state[:, 3:6])
    settings = TrainSettings(population=2, generations=0, epochs=5)
    model = train_flights([(flight.log, None) for flight in flown], settings)
    assert model.settings["teacher"] == "smoother"
    assert model.smoother is None
    with pytest.raises(UsageError, match="without --truth the smoother is the teacher: it needs ga-bpnn-ukf with"):
        train_flights([(flown[0].log, None)], settings, FilterSettings(editing="live"))


def test_a_filter_without_a_smoother_to_prove_it_is_not_taught_motion():
    flight = simulate("manoeuvre-clean", seed=1, dt_s=0.5, duration_s=100.0)
    settings = TrainSettings("motion", population=2, generations=0, epochs=5)
    with pytest.raises(UsageError, match="'motion' needs ga-bpnn-ukf with --editing two-pass"):
        train_flights([(flight.log, flight.truth)], settings, FilterSettings(editing="none"))


@pytest.mark.parametrize("hidden", [None, 3])
def test_a_fleet_begins_with_the_packaged_network(hidden):
    """If that has as many hidden units. It stays what it is where held-out flights do not prefer another."""
    flown = [simulate("manoeuvre-clean", seed=seed, dt_s=0.2, duration_s=60.0) for seed in range(6)]
    settings = TrainSettings("motion", hidden=hidden, population=2, generations=0, epochs=10)
    model, packaged = train_flights([(flight.log, None) for flight in flown], settings), model_file.named("packaged")
    assert model.settings["start"] == ("packaged" if hidden is None else "genetic")
    if hidden is None:
        np.testing.assert_array_equal(network.pack(model.filter.weights), network.pack(packaged.filter.weights))
        np.testing.assert_array_equal(model.filter.envelope.precision, packaged.filter.envelope.precision)
        np.testing.assert_array_equal(model.filter.bound_sigma, packaged.filter.bound_sigma)


def test_a_fleet_whose_errors_are_others_has_a_network_near_the_packaged_one():
    known = network.pack(model_file.named("packaged").filter.weights)
    found = train(fake.flights(1, 8, lag=2.0), TrainSettings("motion", epochs=30))
    assert 0.01 < np.linalg.norm(network.pack(found.weights) - known) / np.linalg.norm(known) < 0.5
