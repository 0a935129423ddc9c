"""From a log to a trajectory: the order of the steps, what is published, and every sentence of refusal."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from ftproc import __version__, pipeline
from ftproc.core.model.frames import from_cartesian
from ftproc.correction import apply, model_file
from ftproc.correction.apply import Correction
from ftproc.correction.model import MOST_SIGMA, Model
from ftproc.errors import InputError, UsageError
from ftproc.methods import registry
from ftproc.quality.summary import text
from ftproc.records import ISOLATED, MISSING, PATCH, MeasurementLog
from ftproc.settings import FilterSettings
from tests.correction.test_apply import constant
from tests.simulated import simulate


@pytest.fixture(scope="module")
def flight():
    return simulate("cruise", seed=1, duration_s=40.0, outliers="isolated=0.03:10-200,offset=1:8-20:20-100,nan=0.02")


def tiny(n):
    flight = simulate("cruise", seed=2, duration_s=10.0, outliers="none")
    return replace(
        flight.log, time_s=flight.log.time_s[:n], measurement=flight.log.measurement[:n], row=np.arange(n)
    ), (flight.truth.position_m[:n])


@pytest.mark.parametrize("settings", [{}, {"smooth": True}, {"editing": "forward"}, {"editing": "none"}], ids=str)
def test_trajectory_has_a_row_for_every_row_of_the_log(flight, settings):
    log = replace(flight.log, row=flight.log.row[::-1].copy())
    trajectory = pipeline.filter_log(log, FilterSettings(**settings))
    n, without = len(log), trajectory.metadata["summary"]["rows_without_estimate"]
    assert without == 0 or settings.get("editing") == "forward"
    assert without <= 0.1 * n
    assert len(trajectory) == n
    assert trajectory.name == log.name
    np.testing.assert_array_equal(trajectory.row, log.row)
    np.testing.assert_array_equal(trajectory.time_s, log.time_s)
    for array, width in ((trajectory.state, 9), (trajectory.sigma, 9), (trajectory.correction, 6)):
        assert array.shape == (n, width)
        assert np.isfinite(array[without:]).all()
    assert (trajectory.sigma[without:] > 0).all()
    assert (trajectory.measurement_sigma[without:] > 0).all()
    assert np.isnan(trajectory.state[:without]).all()
    np.testing.assert_allclose(trajectory.measurement, from_cartesian(trajectory.state[:, :3]))
    np.testing.assert_array_equal(trajectory.outlier == MISSING, np.isnan(log.measurement))
    assert trajectory.nis.shape == (n,)
    assert not trajectory.correction.any()


def test_log_is_not_changed(flight):
    before = flight.log.measurement.copy(), flight.log.time_s.copy()
    pipeline.filter_log(flight.log)
    np.testing.assert_array_equal(flight.log.measurement, before[0])
    np.testing.assert_array_equal(flight.log.time_s, before[1])


def test_same_log_same_trajectory(flight):
    one, other = pipeline.filter_log(flight.log), pipeline.filter_log(flight.log)
    np.testing.assert_array_equal(one.state, other.state)
    assert one.metadata == other.metadata


def test_correction_is_estimate_minus_plain_filter(flight, monkeypatch):
    added = np.random.default_rng(1).normal(size=(len(flight.log), 6))
    monkeypatch.setattr(apply, "correct", lambda run, model, smoothed, signal_db: Correction(added, 0.25))
    plain = pipeline.filter_log(flight.log)
    corrected = pipeline.filter_log(flight.log, model=model_file.named("packaged"))
    np.testing.assert_array_equal(corrected.correction, added)
    np.testing.assert_allclose(corrected.state[:, :6] - plain.state[:, :6], added, atol=1e-9)
    np.testing.assert_array_equal(corrected.state[:, 6:], plain.state[:, 6:])
    np.testing.assert_array_equal(corrected.sigma, plain.sigma)
    np.testing.assert_allclose(corrected.measurement, from_cartesian(corrected.state[:, :3]))
    summary = corrected.metadata["summary"]
    assert summary["correction_outside_training"] == 0.25
    assert summary["correction_largest_m"] == pytest.approx(np.linalg.norm(added[:, :3], axis=1).max())


def test_packaged_correction_is_bounded_by_the_sigmas(flight):
    plain = pipeline.filter_log(flight.log)
    corrected = pipeline.filter_log(flight.log, model=model_file.named("packaged"))
    np.testing.assert_allclose(corrected.state[:, :6] - plain.state[:, :6], corrected.correction, atol=1e-9)
    limit = model_file.named("packaged").filter.bound_sigma[:3].max() * np.linalg.norm(plain.sigma[:, :3], axis=1)
    assert (np.linalg.norm(corrected.correction[:, :3], axis=1) <= 1.001 * limit).all()


@pytest.mark.parametrize("method", ["ukf", "ekf"])
def test_plain_filters_are_not_corrected(flight, method):
    model = Model({"filter": constant("instrument", 1e-4, bound=1e9)})
    assert not pipeline.filter_log(flight.log, FilterSettings(method=method), model).correction.any()


@pytest.mark.parametrize("smooth", [False, True])
def test_a_model_that_states_its_own_bound_is_not_accepted(flight, smooth):
    stage = constant("window" if not smooth else "instrument", 1e9, bound=1e6)
    model = Model({"filter": stage, "smoother": stage})
    corrected = pipeline.filter_log(flight.log, FilterSettings(smooth=smooth), model)
    assert np.abs(corrected.correction / corrected.sigma[:, :6]).max() < 2 * MOST_SIGMA
    trust = corrected.metadata["summary"]["trust"]
    assert trust["verdict"] != "consistent"
    assert any("check that the model is of this instrument" in reason for reason in trust["reasons"])


def test_each_stage_is_corrected_by_its_own_network(flight):
    model = Model(
        {"filter": constant("instrument", 1e-4, bound=1e9), "smoother": constant("instrument", 3e-4, bound=1e9)}
    )
    for smooth, angle in ((False, 1e-4), (True, 3e-4)):
        plain = pipeline.filter_log(flight.log, FilterSettings(smooth=smooth))
        corrected = pipeline.filter_log(flight.log, FilterSettings(smooth=smooth), model)
        turned = corrected.measurement - plain.measurement
        np.testing.assert_allclose(turned[30:, 2], angle, rtol=1e-3)
        np.testing.assert_allclose(corrected.correction, corrected.state[:, :6] - plain.state[:, :6], atol=1e-9)
        assert not corrected.correction[:, 3:].any()
        np.testing.assert_array_equal(corrected.sigma, plain.sigma)


def test_a_model_without_a_network_for_the_smoother_leaves_it_alone_and_says_so(flight):
    model = Model({"filter": constant("instrument", 1e-4, bound=1e9)})
    smoothed = pipeline.filter_log(flight.log, FilterSettings(smooth=True), model)
    assert not smoothed.correction.any()
    assert "corrects the filter only" in text(smoothed.metadata)
    for trajectory in (
        pipeline.filter_log(flight.log, model=model),
        pipeline.filter_log(flight.log, FilterSettings(smooth=True), model_file.named("packaged")),
    ):
        assert "corrects the filter only" not in text(trajectory.metadata)


def test_metadata_is_complete_and_serialisable(flight):
    settings = FilterSettings(
        editing="forward", gate=5.0, max_patch_s=3.0, noise=(4.0, 2e-4, 3e-4), site=(40.0, 3.0, 7.0)
    )
    log = replace(flight.log, frame="north-east-up")
    metadata = pipeline.filter_log(log, settings, model_file.named("packaged")).metadata
    again = json.loads(json.dumps(dict(metadata), allow_nan=False))
    assert again["program"] == "ftproc"
    assert again["version"] == __version__
    assert again["method"] == "ga-bpnn-ukf"
    assert again["log"] == log.name
    assert again["frame"] == "north-east-up"
    assert len(again["model_sha256"]) == 64
    used = again["settings"]
    expected = {"editing": "forward", "smooth": False, "gate": 5.0, "max_patch_s": 3.0, "gain_form": False}
    assert expected.items() <= used.items()
    assert used["site"] == [40.0, 3.0, 7.0]
    assert (used["noise_specified"], used["jerk_specified"]) == (True, False)
    assert used["noise_range_m"] == pytest.approx(4.0)
    assert used["noise_azimuth_rad"] == pytest.approx(2e-4)
    assert used["noise_elevation_rad"] == pytest.approx(3e-4)
    assert all(q > 0 for q in again["jerk_profile"]["psd_m2ps5"])
    assert again["summary"]["rows"] == len(log)
    assert pipeline.filter_log(log).metadata["model_sha256"] is None


@pytest.mark.parametrize(
    ("settings", "editing", "sees"),
    [
        ({}, "two-pass", "past readings, edited with the whole record"),
        ({"editing": "forward"}, "forward", "past readings"),
        ({"smooth": True}, "two-pass", "the whole record"),
        ({"method": "ukf"}, "none", "past readings"),
        ({"method": "ukf", "smooth": True}, "none", "the whole record"),
        ({"method": "huber-ukf"}, "its own", "past readings"),
        ({"method": "wavelet-akf"}, "its own", "the whole record"),
    ],
)
def test_metadata_say_what_an_estimate_rests_on(flight, settings, editing, sees):
    metadata = pipeline.filter_log(flight.log, FilterSettings(**settings)).metadata
    assert metadata["method"] == settings.get("method", "ga-bpnn-ukf")
    assert (metadata["settings"]["editing"], metadata["sees"]) == (editing, sees)


@pytest.mark.parametrize("component", range(3))
@pytest.mark.parametrize("smooth", [False, True])
def test_component_missing_throughout(flight, component, smooth):
    """Position is not observable and left empty, but for a missing elevation, which a height stands in for; what was
    measured is still cleaned."""
    z = flight.log.measurement.copy()
    z[:, component] = np.nan
    log = replace(flight.log, measurement=z)
    trajectory = pipeline.filter_log(log, FilterSettings(smooth=smooth), model_file.named("packaged"))
    assert (np.isfinite if component == 2 else np.isnan)(trajectory.state).all()
    assert (np.isfinite if component == 2 else np.isnan)(trajectory.sigma).all()
    assert np.isnan(trajectory.measurement[:, component]).all()
    assert np.isnan(trajectory.measurement_sigma[:, component]).all()
    others = [c for c in range(3) if c != component]
    assert np.isfinite(trajectory.measurement[:, others]).all()
    assert (trajectory.outlier[:, component] == MISSING).all()
    assert trajectory.metadata["summary"]["not_observable"] == [("range", "azimuth", "elevation")[component]]
    json.dumps(dict(trajectory.metadata), allow_nan=False)
    clean = from_cartesian(flight.truth.position_m)[:, others] - trajectory.measurement[:, others]
    assert np.sqrt((clean**2).mean(0) / np.array(flight.sigma)[others] ** 2).max() < 1
    sigma = trajectory.measurement_sigma[:, others]
    assert (np.abs(clean) <= 3 * sigma).mean(0).min() > 0.95
    assert (np.median(sigma, 0) < np.array(flight.sigma)[others]).all()


@pytest.mark.parametrize("editing", ["live", "forward"])
def test_no_track_is_confirmed_in_a_tiny_log(editing):
    with pytest.raises(InputError, match="the readings are too few, or agree too little, for a track to be confirmed"):
        pipeline.filter_log(tiny(8)[0], FilterSettings(editing=editing))


@pytest.mark.parametrize("settings", [{}, {"smooth": True}, {"editing": "none"}], ids=str)
@pytest.mark.parametrize("n", [1, 2, 3, 5, 8])
def test_tiny_logs(n, settings):
    log, position = tiny(n)
    trajectory = pipeline.filter_log(log, FilterSettings(**settings), model_file.named("packaged"))
    assert len(trajectory) == n
    assert (trajectory.sigma > 0).all()
    assert (np.linalg.norm(trajectory.state[:, :3] - position, axis=1) < 60).all()
    json.dumps(dict(trajectory.metadata), allow_nan=False)


def test_log_of_one_instant():
    log, position = tiny(6)
    trajectory = pipeline.filter_log(replace(log, time_s=np.full(6, 7.0)))
    assert np.isfinite(trajectory.state).all()
    assert np.linalg.norm(trajectory.state[-1, :3] - position[0]) < 200


def empty():
    return MeasurementLog("empty.csv", np.empty(0), np.empty((0, 3)), np.empty(0, int))


def test_refuses_a_log_without_rows_or_readings():
    with pytest.raises(
        InputError, match=r"^empty\.csv: no row has a time, so there is nothing to filter; check the time column\.$"
    ):
        pipeline.filter_log(empty())
    log, _ = tiny(5)
    nothing = replace(log, name="x.csv", measurement=np.full((5, 3), np.nan))
    with pytest.raises(
        InputError, match=r"^x\.csv: range, azimuth and elevation are missing in every row; check the columns"
    ):
        pipeline.filter_log(nothing)


def stub(monkeypatch, run):
    monkeypatch.setitem(registry.METHODS, "ukf", replace(registry.METHODS["ukf"], run=run))
    log = replace(tiny(20)[0], name="x.csv")
    return lambda: pipeline.filter_log(log, FilterSettings(method="ukf"))


@pytest.mark.parametrize(
    ("cause", "message"),
    [
        (ValueError(0), "no range reading agrees with its neighbours, so there is no first state; check the column"),
        (ValueError(2), "no elevation reading agrees with its neighbours"),
        (ValueError("singular"), "singular"),
    ],
)
def test_refuses_a_log_without_a_first_state(monkeypatch, cause, message):
    def fail(*_):
        raise cause

    with pytest.raises(InputError) as caught:
        stub(monkeypatch, fail)()
    assert str(caught.value).startswith(f"x.csv: {message}")
    assert caught.value.__cause__ is cause


def test_refuses_to_publish_a_diverged_filter(monkeypatch):
    plain = registry.METHODS["ukf"].run

    def diverge(*arguments):
        found = plain(*arguments)
        found.run.state[3:] = np.nan
        return found

    with pytest.raises(InputError, match=r"^x\.csv: ukf diverged; give --noise and --jerk, or check the log's units$"):
        stub(monkeypatch, diverge)()


def test_a_blank_of_a_channel_method_is_no_divergence_but_infinity_is(monkeypatch):
    plain = registry.METHODS["gate"].run

    def run(value):
        def changed(*arguments):
            found = plain(*arguments)
            found.run.state[3:] = value
            return found

        return changed

    assert np.isnan(stub(monkeypatch, run(np.nan))().state[3:]).all()
    with pytest.raises(InputError, match=r"^x\.csv: ukf diverged; "):
        stub(monkeypatch, run(np.inf))()


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"method": "ufk"}, "there is no method 'ufk'; did you mean 'ukf'"),
        ({"editing": "twopass"}, "editing is one of two-pass, live, forward, none, not 'twopass'"),
        ({"noise": (1.0, 0.0, 1.0)}, "noise must be a positive number, from 1e-30 to 1e+30, not 0.0"),
        ({"noise": (1.0, 1.0, float("nan"))}, "noise must be a positive number, from 1e-30 to 1e+30, not nan"),
        ({"jerk_psd_m2ps5": -1.0}, "jerk must be a positive number, from 1e-30 to 1e+30, not -1.0"),
        ({"gate": float("inf")}, "gate must be a positive number, from 1e-30 to 1e+30, not inf"),
        ({"max_patch_s": 0.0}, "max-patch must be a positive number, from 1e-30 to 1e+30, not 0.0"),
    ],
)
def test_refuses_settings_that_make_no_sense(flight, settings, message):
    with pytest.raises(UsageError) as caught:
        pipeline.filter_log(flight.log, FilterSettings(**settings))
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize("smooth", [False, True])
def test_diagnostics_are_what_the_estimate_was_made_from(flight, smooth):
    z = flight.log.measurement.copy()
    z[5, 0], z[:, 2] = np.nan, np.nan
    log = replace(flight.log, measurement=z)
    trajectory = pipeline.filter_log(log, FilterSettings(smooth=smooth))
    found = trajectory.diagnostics
    assert found is not None
    np.testing.assert_array_equal(found.reading, z)
    np.testing.assert_array_equal(np.isnan(found.residual), np.isnan(z))
    assert found.residual_kind == ("leave-one-out residual" if smooth else "innovation")
    good = trajectory.outlier[:, :2] == 0
    scaled = (found.residual / found.residual_sigma)[:, :2][good]
    assert np.sqrt((scaled**2).mean()) == pytest.approx(1, abs=0.2)
    off = (trajectory.outlier[:, :2] == 1) | (trajectory.outlier[:, :2] == 2)
    if off.any():
        assert np.abs((found.residual / found.residual_sigma)[:, :2][off]).max() > 4


@pytest.mark.parametrize("number", [1e300, -1e300, 1e12])
@pytest.mark.parametrize("channel", [0, 1, 2])
def test_a_number_that_no_instrument_reads_is_an_outlier(flight, channel, number):
    z = flight.log.measurement.copy()
    z[100:103, channel] = np.nan
    without = pipeline.filter_log(replace(flight.log, measurement=z), FilterSettings())
    z[101, channel] = number
    found = pipeline.filter_log(replace(flight.log, measurement=z.copy()), FilterSettings())
    assert found.outlier[101, channel] in (ISOLATED, PATCH)
    assert (np.abs(found.state - without.state) < 0.2 * without.sigma).all()
