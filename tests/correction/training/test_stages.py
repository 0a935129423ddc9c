"""Which network for which stage."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ftproc.correction.training.samples import Flight
from ftproc.correction.training.stages import train_model
from ftproc.errors import UsageError
from ftproc.settings import TrainSettings
from tests.correction import fake

QUICK = TrainSettings(hidden=4, population=8, generations=5, epochs=40)


def tilted(seed: int, count: int) -> list[Flight]:
    """Flights seen by an instrument whose elevation is off by 4 mrad times the cosine of the azimuth."""
    made = []
    for number in range(count):
        rng = np.random.default_rng([seed, number])
        run = fake.run(rng)
        turn = rng.uniform(-np.pi, np.pi)
        x, y = run.state[:, 0].copy(), run.state[:, 1].copy()
        run.state[:, 0], run.state[:, 1] = np.cos(turn) * x - np.sin(turn) * y, np.sin(turn) * x + np.cos(turn) * y
        flat, distance = np.hypot(x, y), np.linalg.norm(run.state[:, :3], axis=1)
        error = rng.normal(size=(600, 6))
        error[:, 2] -= 4e-3 * run.state[:, 0] / flat * distance / fake.SIGMA[2]
        made.append(fake.with_error(run, error))
    return made


def test_what_lies_in_the_innovations_is_left_to_the_window_and_the_smoother_to_itself() -> None:
    model = train_model({"filter": fake.flights(2, 8, lag=2.0), "smoother": fake.flights(3, 8)}, QUICK)
    assert model.filter.features.name == "window"
    assert model.filter.helps
    assert model.smoother is None


def test_what_lies_in_the_direction_is_learned_for_both() -> None:
    model = train_model({"filter": tilted(0, 8), "smoother": tilted(1, 8)}, QUICK)
    assert [stage.features.name for stage in model.stages.values()] == ["instrument", "instrument"]
    for stage in model.stages.values():
        assert stage.gain[2] > 0.9
        assert stage.weights.direct.any()
        assert not stage.weights.w2.any()  # what is linear needs no hidden layer


def test_a_feature_set_that_is_named_is_taken_and_serves_the_smoother_if_it_can() -> None:
    flights = {"filter": tilted(0, 8), "smoother": tilted(1, 8)}
    for features, stages in (
        ("window", ["filter"]),
        ("correction", ["filter"]),
        ("instrument", ["filter", "smoother"]),
    ):
        model = train_model(flights, replace(QUICK, features=features))
        assert list(model.stages) == stages
        assert model.filter.features.name == features
    with pytest.raises(UsageError, match="no feature set 'magic'"):
        train_model(flights, replace(QUICK, features="magic"))
