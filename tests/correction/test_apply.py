"""The guards at run time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ftproc.core.filtering.records import FilterRun
from ftproc.correction import apply
from ftproc.correction.apply import correct
from ftproc.correction.envelope import Envelope, Normaliser
from ftproc.correction.feature_sets import FEATURES, named
from ftproc.correction.features import SETTLING, LineOfSight
from ftproc.correction.model import MOST_SIGMA, Stage
from ftproc.correction.network import Weights
from ftproc.records import FloatArray
from tests.correction import fake


def constant(name: str, output: float, gain: float = 1.0, bound: float = 2.0) -> Stage:
    """A stage whose network has the constant output `output`, with an envelope that holds all inputs."""
    features = named(name)
    d, o = features.input_size, features.output_size
    return Stage(
        features,
        Weights(
            np.zeros((2, d)), np.zeros(2), np.zeros((o, 2)), np.full(o, output), np.zeros((o, d * features.direct))
        ),
        Normaliser(np.zeros(d), np.ones(d)),
        Normaliser(np.zeros(o), np.ones(o)),
        Envelope(np.eye(d), 1e12),
        np.full(6, gain),
        np.full(6, bound),
        "none",
    )


def ahead(filtered: FilterRun, sigmas: float) -> FloatArray:
    """(n, 9) states that are so many sigmas away along each line-of-sight axis: a smoother's that proves them."""
    states = filtered.state.copy()
    los = LineOfSight.of(filtered, 0, len(states))
    states[:, :6] += los.to_cartesian(sigmas * los.sigma)
    return states


@pytest.mark.parametrize(("sigmas", "applied"), [(0.5, 0.5), (2.0, 0.8), (0.2, 0.2), (-0.5, 0.0)])
def test_the_smoother_of_the_flight_bounds_and_proves_a_correction(sigmas: float, applied: float) -> None:
    filtered = fake.run(np.random.default_rng(1))
    found = correct(filtered, constant("motion", 0.8), ahead(filtered, sigmas))
    along = LineOfSight.of(filtered, 0, 600).from_cartesian(found.values) / filtered.los_sigma
    assert along[SETTLING:] == pytest.approx(np.full((575, 6), applied))
    assert bool(found.why_not) == (not applied)


def test_without_a_smoother_nothing_is_proven() -> None:
    found = correct(fake.run(np.random.default_rng(1)), constant("motion", 0.5))
    assert not found.values.any()
    assert found.why_not == "there is no smoother of this run that could prove it"


def test_zero_while_coasting_and_settling_and_nowhere_else() -> None:
    filtered = fake.without(fake.run(np.random.default_rng(0)), slice(100, 110))
    filtered = fake.without(filtered, slice(200, 210), [0, 2])
    zero = ~np.any(correct(filtered, constant("window", 0.5)).values, axis=1)
    assert np.flatnonzero(zero).tolist() == [*range(SETTLING), *range(100, 110)]


@pytest.mark.parametrize("output", [0.5, 1.9, 2.1, -40.0])
def test_the_output_is_applied_within_two_sigmas(output: float) -> None:
    filtered = fake.run(np.random.default_rng(1))
    values = correct(filtered, constant("window", output)).values
    along = LineOfSight.of(filtered, 0, 600).from_cartesian(values) / filtered.los_sigma
    assert along[SETTLING:] == pytest.approx(np.full((575, 6), np.clip(output, -2, 2)))


@pytest.mark.parametrize("name", FEATURES)
def test_every_feature_set_is_bounded_along_the_line_of_sight(name: str) -> None:
    filtered = fake.run(np.random.default_rng(1))
    values = correct(filtered, constant(name, 1e4), ahead(filtered, 3.0), np.full(600, 20.0)).values
    along = LineOfSight.of(filtered, 0, 600).from_cartesian(values) / filtered.los_sigma
    assert np.abs(along).max() == pytest.approx(2.0)


def test_the_gain_scales_each_output() -> None:
    filtered = fake.run(np.random.default_rng(2))
    model = replace(constant("correction", 0.1), gain=np.array([1, 0.5, 0, 1, 0, 0.2]))
    values = correct(filtered, model).values
    assert values[SETTLING:] == pytest.approx(np.tile([0.1, 0.05, 0, 0.1, 0, 0.02], (575, 1)))


def test_nothing_at_all_with_zero_gain() -> None:
    assert not correct(fake.run(np.random.default_rng(2)), constant("window", 1.0, gain=0.0)).values.any()


def test_zero_outside_the_training_envelope_and_the_share_is_returned() -> None:
    filtered = fake.run(np.random.default_rng(3))
    model = replace(constant("correction", 0.5), envelope=Envelope(np.eye(9), 40.0))
    predicted = filtered.predicted.copy()
    predicted[200:223, 4] += 50.0
    found = correct(filtered._replace(predicted=predicted), model)
    assert not found.values[200:223].any()
    assert found.values[SETTLING:200].any(axis=1).all()
    assert found.outside == pytest.approx(23 / 575)


def test_unusable_samples_do_not_count_as_outside() -> None:
    filtered = fake.without(fake.run(np.random.default_rng(3)), slice(None))
    model = replace(constant("window", 0.5), envelope=Envelope(np.eye(41), 0.0))
    assert correct(filtered, model).outside == 0.0


def test_long_runs_in_chunks_give_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    filtered = fake.run(np.random.default_rng(4))
    model = constant("window", 0.0)
    model = replace(model, weights=model.weights._replace(w1=np.ones((2, 41)), w2=np.ones((6, 2))))
    whole = correct(filtered, model)
    monkeypatch.setattr(apply, "CHUNK", 37)
    assert correct(filtered, model).values == pytest.approx(whole.values, abs=1e-12)
    assert whole.values.any()


def test_the_correction_is_finite() -> None:
    filtered = fake.run(np.random.default_rng(5))
    state, innovation = filtered.state.copy(), filtered.innovation.copy()
    state[50:60] = np.nan
    innovation[70, 0] = np.nan  # with a weight: should not happen, must not hurt
    found = correct(filtered._replace(state=state, innovation=innovation), constant("window", 0.5))
    assert np.isfinite(found.values).all()
    assert not found.values[50:60].any()


def test_an_empty_run() -> None:
    found = correct(fake.run(np.random.default_rng(0), n=0), constant("window", 1.0))
    assert found.values.shape == (0, 6)
    assert found.outside == 0.0


@pytest.mark.parametrize("stated", [1e3, 1e6, 1e300])
def test_the_largest_bound_is_the_programs(stated: float) -> None:
    filtered = fake.run(np.random.default_rng(1))
    values = correct(filtered, constant("window", 1e9, bound=stated)).values
    along = LineOfSight.of(filtered, 0, 600).from_cartesian(values) / filtered.los_sigma
    assert np.abs(along).max() == pytest.approx(MOST_SIGMA)
