"""The methods by name."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.errors import UsageError
from ftproc.methods import registry
from ftproc.methods.estimate import Readings
from ftproc.settings import FilterSettings
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
    assert np.isfinite(found.run.state).all()
    assert bool(found.label[np.isfinite(flight.log.measurement)].any()) == method.handles_outliers


def test_default_is_the_anti_outlier_filter():
    method = registry.named(FilterSettings().method)
    assert method.handles_outliers
    assert method.corrected


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("ufk", "there is no method 'ufk'; did you mean 'ukf'? (`ftproc filter --list-methods` lists them)"),
        ("wavelets!", "there is no method 'wavelets!' (`ftproc filter --list-methods` lists them)"),
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
