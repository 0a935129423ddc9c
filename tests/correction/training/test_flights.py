"""What a correction is trained from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ftproc.correction.training.flights import train_flights
from ftproc.errors import InputError, UsageError
from ftproc.records import Truth
from ftproc.settings import FilterSettings, TrainSettings
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


def test_of_live_editing_the_filter_alone_is_corrected():
    flight = simulate("manoeuvre", seed=1, dt_s=0.5, duration_s=100.0)
    settings = TrainSettings(population=2, generations=0, epochs=5)
    model = train_flights([(flight.log, flight.truth)], settings, FilterSettings(editing="live", lag_s=1.0))
    assert model.smoother is None
    assert model.settings["editing"] == "live"
    assert model.settings["lag_s"] == 1.0
