"""The methods by name."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from ftproc import pipeline, simulation
from ftproc.correction.training.flights import train_flights
from ftproc.errors import UsageError
from ftproc.methods import registry
from ftproc.methods.estimate import Readings
from ftproc.settings import FilterSettings, TrainSettings
from tests.simulated import simulate


@pytest.mark.parametrize("name", list(registry.METHODS))
def test_every_method_runs(name):
    flight = simulate("cruise", seed=3, duration_s=30.0)
    method = registry.named(name)
    assert method.name == name
    readings = Readings(flight.log.time_s, flight.log.measurement, np.full(3, np.nan))
    found = method.run(readings, FilterSettings(method=name))
    assert found.run.state.shape == (len(flight.log), 9)
    assert found.label.shape == (len(flight.log), 3)
    assert np.isfinite(found.run.state).all() == (found.cleaned is None)
    assert bool(found.label[np.isfinite(flight.log.measurement)].any()) == method.handles_outliers


def test_default_is_the_anti_outlier_filter():
    method = registry.named(FilterSettings().method)
    assert method.handles_outliers
    assert method.corrected


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("ufk", "there is no method 'ufk'; did you mean 'ukf'? (`ftproc filter --list-methods` lists them)"),
        ("butterworth!", "there is no method 'butterworth!' (`ftproc filter --list-methods` lists them)"),
    ],
)
def test_unknown_method_names_the_nearest(name, message):
    with pytest.raises(UsageError) as caught:
        registry.named(name)
    assert str(caught.value) == message


def test_list_shows_every_method():
    lines = registry.list_methods().splitlines()
    assert len(lines) == 1 + len(registry.METHODS)
    for method, line in zip(registry.METHODS.values(), lines[1:], strict=True):
        assert line.startswith(method.name + " ")
        assert method.title in line
        assert method.source in line


@pytest.mark.parametrize(
    ("name", "smooth", "made_for", "message"),
    [
        ("ga-bpnn-ukf", True, None, None),
        ("ga-bpnn-ukf", False, "ga-bpnn-ukf", None),
        ("ukf", False, "bpnn-ekf", None),
        ("bpnn-ekf", False, "bpnn-ekf", None),
        ("gate", True, None, "gate has no smoother; leave --smooth out."),
        (
            "bpnn-ekf", False, "ga-bpnn-ukf",
            "bpnn-ekf needs a model trained for it: ftproc train --method bpnn-ekf --scenario manoeuvre "
            "-o M.safetensors, then --model M.safetensors.",
        ),
        (
            "ga-bpnn-ukf", False, "bpnn-ekf",
            "ga-bpnn-ukf cannot use a model that was trained for bpnn-ekf; give another with --model, or none.",
        ),
    ],
)  # fmt: skip
def test_obstacles(name, smooth, made_for, message):
    assert registry.obstacle(registry.named(name), smooth, made_for) == message


def test_missing_extra_is_a_sentence(monkeypatch):
    monkeypatch.setattr(registry, "find_spec", lambda name: None)
    message = 'wavelet-akf needs PyWavelets, which is not installed: pip install "PyWavelets>=1.5".'
    assert registry.obstacle(registry.named("wavelet-akf"), False, None) == message
    with pytest.raises(UsageError) as caught:
        pipeline.filter_log(simulate("cruise", duration_s=10.0).log, FilterSettings(method="wavelet-akf"))
    assert str(caught.value) == message


def test_a_model_for_the_ekf_corrects_the_ekf_and_only_that():
    flights = [simulate("cruise", seed=seed, duration_s=60.0) for seed in range(4)]
    settings = TrainSettings(method="bpnn-ekf", hidden=4, epochs=20, seed=1)
    model = train_flights([(f.log, f.truth) for f in flights], settings)
    assert model.made_for == "bpnn-ekf"
    assert model.settings["start"] == "random"
    stage = replace(model.filter, gain=np.full(6, 0.5))  # whatever held-out flights say
    model = replace(model, stages={"filter": stage})
    log = flights[0].log
    plain = pipeline.filter_log(log, FilterSettings(method="ekf"))
    corrected = pipeline.filter_log(log, FilterSettings(method="bpnn-ekf"), model)
    assert np.abs(corrected.correction).max() > 0
    np.testing.assert_allclose(corrected.state[:, :6] - corrected.correction, plain.state[:, :6], atol=1e-9)
    with pytest.raises(UsageError, match=r"^ga-bpnn-ukf cannot use a model that was trained for bpnn-ekf; "):
        pipeline.filter_log(log, FilterSettings(), model)


def test_only_options_that_change_something_are_accepted():
    """Each option with each method and way of editing: refused where the trajectory stays the same, bit for bit,
    whatever else of that kind is given with it."""
    log = simulation.simulate("zuo2021-outliers", seed=1).log
    changes = {
        "--editing": ({"editing": "forward"}, {"editing": "none"}, {"editing": "two-pass"}),
        "--lag": ({"lag_s": 1.0},),
        "--particles": ({"particles": 95},),
        "--seed": ({"seed": 5},),
        "--weight-form": ({"gain_form": True},),
    }

    def made(settings: FilterSettings) -> bytes:
        found = pipeline.filter_log(log, settings)
        return found.state.tobytes() + found.sigma.tobytes() + found.outlier.tobytes()

    modes = [(registry.MAIN, way) for way in ("two-pass", "live", "forward", "none")]
    modes += [
        (name, "two-pass")
        for name, method in registry.METHODS.items()
        if name != registry.MAIN and not method.own_model
    ]
    for name, editing in modes:
        plain = FilterSettings(method=name, editing=editing, particles=90)
        before = made(plain)
        used = {option for option in changes if registry.USES[option].by(registry.METHODS[name], plain)}
        for option in used:
            assert any(made(replace(plain, **way)) != before for way in changes[option]), (name, editing, option)
        for ways in product(*(changes[option] for option in changes if option not in used)):
            together = {field: value for way in ways for field, value in way.items()}
            assert made(replace(plain, **together)) == before, (name, editing, together)
