"""The ensemble and particle filters as methods: real logs, plain warnings, same bytes."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from ftproc import pipeline
from ftproc.core.comparators import particles
from ftproc.errors import FtprocWarning, InputError, UsageError
from ftproc.methods.estimate import Readings
from ftproc.methods.papers import ensemble
from ftproc.records import GOOD, MISSING
from ftproc.settings import FilterSettings
from tests.methods.flights import PATHS, TIME, held, measured, rms, run
from tests.simulated import simulate

NAMES = list(particles.UPDATES)
ROUGH = "isolated=0.03:8-60,nan=0.05,nanrun=1:5-20,gap=1:1-2,jitter=0.2,duplicates=3"


@pytest.mark.parametrize("name", NAMES)
def test_a_rough_log_is_followed(name):
    """Missing components, odd and double times, gaps and outliers."""
    flight = simulate("manoeuvre", seed=5, duration_s=12.0, outliers=ROUGH)
    found = pipeline.filter_log(flight.log, FilterSettings(method=name))
    missing = np.isnan(flight.log.measurement)
    assert np.isfinite(found.state).all()
    assert (found.sigma > 0).all()
    assert ((found.outlier == MISSING) == missing).all()
    assert found.metadata["settings"]["particles"] == 100
    assert found.metadata["settings"]["seed"] == 0
    bad = (flight.truth.outlier > 0) & ~missing
    if name in ("enpf-chi2", "renpf"):
        assert rms(found, flight.truth.position_m) < 8
        assert (found.outlier[bad] != GOOD).mean() > 0.95
        assert (found.outlier[~bad & ~missing] != GOOD).mean() < 0.05
    else:
        assert rms(found, flight.truth.position_m) < 60
        assert (found.outlier[~missing] == GOOD).all()


def test_isolated_outliers_are_refused():
    """5 % of the samples, 8 to 60 sigmas: renpf's error is below a third of enkf's, and its sigmas hold."""
    errors = []
    for scenario, seed in (("cruise", 12), ("radar", 2), ("manoeuvre", 13)):
        duration = 150.0 if scenario == "radar" else 20.0
        flight = simulate(scenario, seed=seed, duration_s=duration, outliers="all.isolated=0.05:8-60")
        fuzzy, plain = (pipeline.filter_log(flight.log, FilterSettings(method=m)) for m in ("renpf", "enkf"))
        assert held(fuzzy, flight.truth.position_m) > 0.9
        errors.append([rms(found, flight.truth.position_m) for found in (fuzzy, plain)])
    fuzzy_m, plain_m = np.array(errors).T
    assert (fuzzy_m < plain_m / 3).all()


def test_blame_is_on_the_component_that_is_off():
    flight = simulate("cruise", seed=2, duration_s=15.0, outliers="azimuth.isolated=0.05:20-60")
    found = pipeline.filter_log(flight.log, FilterSettings(method="renpf"))
    hit = np.flatnonzero(flight.truth.outlier[:, 1] > 0)
    hit = hit[hit >= 10]  # the first state is uncertain
    assert len(hit) > 5
    assert (found.outlier[hit, 1] != GOOD).all()
    assert (found.outlier[hit][:, [0, 2]] != GOOD).mean() < 0.2


def test_same_seed_same_bytes_and_another_seed_another():
    log = simulate("zuo2021", seed=1).log
    settings = [FilterSettings(method="renpf", seed=seed) for seed in (1, 1, 2)]
    once, again, other = (pipeline.filter_log(log, s).state.tobytes() for s in settings)
    assert once == again != other


def test_a_component_missing_throughout():
    log = simulate("cruise", seed=3, duration_s=10.0).log
    log.measurement[:, 0] = np.nan
    found = pipeline.filter_log(log, FilterSettings(method="renpf"))
    assert np.isnan(found.state).all()
    assert np.isfinite(found.measurement[:, 1:]).all()


def test_one_row_is_enough():
    log = measured(PATHS["receding"](TIME)[:1], TIME[:1])
    assert np.isfinite(run(log, method="renpf").state).all()


def test_smoothing_is_refused():
    log = measured(PATHS["receding"](TIME)[:50], TIME[:50])
    with pytest.raises(UsageError, match=r"^renpf has no smoother; leave --smooth out\.$"):
        run(log, method="renpf", smooth=True)


def test_few_particles_are_warned_of():
    log = measured(PATHS["receding"](TIME)[:30], TIME[:30])
    message = "^renpf: 40 particles are few for 9 states; 90 or more are trustworthy$"
    with pytest.warns(FtprocWarning, match=message):
        run(log, method="renpf", particles=40)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run(log, method="renpf")


def test_too_few_particles_are_refused():
    log = measured(PATHS["receding"](TIME)[:30], TIME[:30])
    with pytest.raises(UsageError, match=r"^particles must be 20 or more, not 19$"):
        run(log, method="renpf", particles=19)


def test_long_work_is_said_and_hours_are_refused(monkeypatch):
    """Without doing it."""

    class Started(Exception):
        pass

    def begin(*_):
        raise Started

    monkeypatch.setattr(ensemble.preparing, "prepare", begin)

    def tried(rows, particles):
        readings = Readings(np.arange(float(rows)), np.ones((rows, 3)), np.full(3, np.nan))
        return ensemble.estimate(readings, FilterSettings(method="renpf", particles=particles), "renpf")

    def seconds(rows, particles):
        return ensemble.expected_seconds("renpf", rows, particles)

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(Started):
            tried(2000, 100)
    for rows in (50_000, 200_000):
        spoken = f"{seconds(rows, 100):.0f} s" if seconds(rows, 100) < 120 else f"{seconds(rows, 100) / 60:.0f} minutes"
        with (
            pytest.warns(FtprocWarning, match=f"^renpf: {rows} rows will take about {spoken}$"),
            pytest.raises(Started),
        ):
            tried(rows, 100)
    with pytest.raises(ValueError, match=r"^1000000 rows would take renpf about [0-9.]+ hours with 300 particles; cut"):
        tried(1_000_000, 300)


def test_hours_are_refused_in_a_sentence_that_names_the_log(monkeypatch):
    monkeypatch.setattr(ensemble, "TOO_LONG_S", 0.01)
    monkeypatch.setattr(ensemble, "WORTH_SAYING_S", 0.0)
    log = measured(PATHS["receding"](TIME), TIME)
    with pytest.raises(
        InputError, match=r"^flight\.csv: 600 rows would take enkf about 0\.0 hours with 100 particles;"
    ):
        run(log, method="enkf")
