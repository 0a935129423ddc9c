"""What past flights make of the packaged network: those that are left out in turn decide."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ftproc.correction import model_file, network
from ftproc.correction.feature_sets import named
from ftproc.correction.model import Stage
from ftproc.correction.network import Weights
from ftproc.correction.training import fleet, silent
from ftproc.correction.training.holdout import with_verdict
from ftproc.correction.training.prepared import prepare
from ftproc.correction.training.samples import Samples, samples
from ftproc.settings import TrainSettings
from tests.correction import fake

SETTINGS = TrainSettings("motion", epochs=5)


def packaged() -> Stage:
    model = model_file.named("packaged")
    assert model is not None
    return model.filter


def test_each_flight_is_judged_by_what_the_others_taught() -> None:
    flights, known = fake.flights(1, 8, lag=2.0), packaged()
    data = prepare(flights, named("motion"), 0, known)
    found, better = fleet._left_out(known, flights, data, SETTINGS, silent)
    pieces = [*data.parts.training, *data.parts.validation]
    assert better
    assert list(found) == pieces
    for piece in pieces:
        others = [each for each in pieces if each != piece]
        tables = [data.normalised(samples(flights, [each], known.features, len(pieces))) for each in others]
        alone = fleet._near(known, Samples.of(tables), len(others), SETTINGS, silent)
        np.testing.assert_array_equal(network.pack(found[piece]), network.pack(alone))


def test_of_more_flights_several_are_left_out_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fleet, "MOST_FITS", 2)
    flights, known = fake.flights(1, 8, lag=2.0), packaged()
    data = prepare(flights, named("motion"), 0, known)
    found, _ = fleet._left_out(known, flights, data, SETTINGS, silent)
    pieces = [*data.parts.training, *data.parts.validation]
    assert sorted(found) == sorted(pieces)
    first = network.pack(found[pieces[0]])
    alike = [np.array_equal(network.pack(found[piece]), first) for piece in pieces]
    assert alike == [k % 2 == 0 for k in range(len(pieces))]


def test_the_weights_that_left_a_flight_out_decide_the_gain() -> None:
    flown, known = fake.flights(1, 8, lag=2.0), packaged()
    flights = [replace(flight, smoothed=flight.run.state + flight.error) for flight in flown]
    data = prepare(flights, named("motion"), 0, known)
    stage = fleet.taught(known, flights, data, SETTINGS)
    assert stage.helps
    assert stage.verdict is not None
    assert stage.verdict.in_turn
    assert stage.verdict.training == stage.verdict.validation == 8 - stage.verdict.test
    nothing = Weights(*(np.zeros_like(layer) for layer in stage.weights))
    left_out = dict.fromkeys([*data.parts.training, *data.parts.validation], nothing)
    assert not with_verdict(stage, flights, data.parts, np.random.default_rng(0), left_out).helps
