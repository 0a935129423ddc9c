"""Two-pass editing on simulated flights whose outliers are known."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from ftproc.core.editing import alternatives, decisions, reassessment, screened, two_pass
from ftproc.core.editing.lasting import settling
from ftproc.core.filtering.initialization import first_state
from ftproc.core.filtering.records import Observations
from ftproc.core.work import WORK, Work
from tests.core.tracks import matched, position_error
from tests.simulated import codes, deviation, simulate
from tests.trust import hard

pytestmark = pytest.mark.compiled

UNKNOWN = two_pass.Known(np.full(3, np.nan), None, 4.0)


def edit(flight, gate=4.0):
    return two_pass.edit(flight.log.time_s, flight.log.measurement, UNKNOWN._replace(gate=gate))


def flags(flight, edited):
    """(n, 3) rejected readings, tampered readings off by 8 sigmas and more, good readings."""
    seen = np.isfinite(flight.log.measurement)
    bad = codes(flight) > 0
    large = bad & seen & (np.abs(deviation(flight)) >= 8 * np.array(flight.sigma))
    return seen & (edited.weight == 0), large, seen & ~bad


def inside(flight, edited):
    """Share of samples whose position lies within 3 of its sigmas along every axis."""
    error = np.abs(edited.smoothed().state[:, :3] - flight.truth.position_m)
    return (error < 3 * edited.smoothed().sigma[:, :3]).all(1).mean()


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("scenario", ["manoeuvre-clean", "calibration"])
def test_clean_flight_is_left_alone(scenario, seed):
    flight = simulate(scenario, seed=seed, duration_s=60.0)
    edited = edit(flight)
    assert (edited.weight == 0).mean() < 0.001
    np.testing.assert_allclose(np.sqrt(edited.model.noise_variance), flight.sigma, rtol=0.1)
    assert edited.decision.settled
    assert inside(flight, edited) > 0.95


DIRT = {
    "isolated": "isolated=0.05:8-300",
    "a fifth": "isolated=0.2:8-300",
    "patches": "isolated=0.01:8-200,offset=2:4-25:8-100,ramp=1:6-25:30-200",
    "all at once": "all.offset=2:5-20:10-100",
    "stuck and burst": "stuck=1:5-20,burst=1:5-20:20-100",
    "bad start": "start=6:15-300",
    "heavy tails": "isolated=0.03:8-200,tails=8",
    "irregular": "isolated=0.03:8-200,jitter=0.3,duplicates=10,gap=2:3-8,nan=0.05,nanrun=2:4-20",
}


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("dirt", DIRT)
def test_outliers_of_8_sigmas_are_found(dirt, seed):
    flight = simulate("cruise", seed=seed, duration_s=100.0, outliers=DIRT[dirt])
    edited = edit(flight)
    rejected, large, good = flags(flight, edited)
    assert large.sum() > 15
    assert rejected[large].mean() >= (0.9 if dirt == "stuck and burst" else 0.98)
    assert rejected[good].mean() < 0.01
    np.testing.assert_allclose(np.sqrt(edited.model.noise_variance), flight.sigma, rtol=0.1)
    assert inside(flight, edited) > 0.9


@pytest.mark.parametrize("scenario", ["overhead", "radar"])
def test_other_flights(scenario):
    flight = simulate(scenario, seed=1)
    rejected, large, good = flags(flight, edited := edit(flight))
    assert rejected[large].mean() > 0.98
    assert rejected[good].mean() < 0.005
    assert inside(flight, edited) > 0.93


def test_rounded_readings_are_kept():
    flight = simulate("cruise", seed=1, duration_s=60.0, outliers="range.round=2m,azimuth.round=0.2mrad")
    rejected, _, good = flags(flight, edited := edit(flight))
    assert rejected[good].mean() < 0.002
    assert edited.decision.settled


def test_gate_decides_how_much_is_kept():
    flight = simulate("cruise", seed=2, duration_s=100.0, outliers="isolated=0.1:3-8")
    kept = [edit(flight, gate).weight.sum() for gate in (4.0, 6.0, 9.0)]
    assert kept[0] <= kept[1] <= kept[2]
    assert kept[0] < kept[2]


def test_narrow_gate_keeps_less_than_the_usual_one():
    flight = simulate("cruise", seed=2, duration_s=100.0, outliers="isolated=0.1:3-8")
    assert edit(flight, 3.0).weight.sum() < edit(flight, 4.0).weight.sum()


def test_specified_noise_and_jerk_are_kept():
    flight = simulate("cruise", seed=3, duration_s=60.0)
    sigma = np.array([7.0, np.nan, 4e-4])
    edited = two_pass.edit(flight.log.time_s, flight.log.measurement, two_pass.Known(sigma, 12.0, 4.0))
    np.testing.assert_allclose(edited.model.noise_variance[[0, 2]], sigma[[0, 2]] ** 2)
    np.testing.assert_allclose(edited.model.jerk, [[12.0, 12.0, 12.0]])
    assert edited.model.noise_variance[1] != pytest.approx(12.0)


def test_component_that_agrees_nowhere_is_named():
    a = matched(1, 50)
    a.z[:, 1] = np.nan
    with pytest.raises(ValueError, match=r"^1$"):
        two_pass.edit(a.time, a.z, UNKNOWN)


def test_missing_readings_have_no_weight_and_decisions_are_all_or_nothing():
    flight = simulate("manoeuvre", seed=0, duration_s=40.0)
    edited = edit(flight)
    assert not edited.weight[~np.isfinite(flight.log.measurement)].any()
    assert set(np.unique(edited.weight)) <= {0.0, 1.0}
    assert edited.decision.rounds <= decisions.MAX_ROUNDS


def test_screening_trusts_most_of_a_clean_log_and_finds_its_noise():
    a = matched(2, 600, q=1e-2)
    weight, _, sigma, _ = screened.screen(a.time, a.z, np.zeros(3))
    assert weight.mean() > 0.95
    np.testing.assert_allclose(sigma**2, a.model.noise_variance, rtol=0.6)


def test_first_state_from_the_edited_log_is_near_the_truth():
    flight = simulate("cruise", seed=5, duration_s=30.0, outliers="start=6:15-300")
    edited = edit(flight)
    log = Observations(flight.log.time_s, flight.log.measurement, edited.weight)
    start = first_state(log, edited.model.noise_variance, 0, slice(0, 200))
    error = position_error(start.state[None], flight.truth.position_m[:1])[0]
    assert error < 3 * np.sqrt(np.trace(start.covariance[:3, :3]))


NOT_IN_SHORT_ONES = ("late_stamps", "allow_for_tails", "allow_for_drift", "allow_for_colour")


@pytest.mark.parametrize("short", [False, True])
def test_noise_of_a_short_window_is_taken_for_white_and_even(monkeypatch, short):
    """Neither late stamps nor tails, drift or correlation are asked for, in a window too short to tell."""
    asked = []

    def spied(name):
        whole = getattr(two_pass, name)
        return lambda *given, **named: asked.append(name) or whole(*given, **named)

    for name in NOT_IN_SHORT_ONES:
        monkeypatch.setattr(two_pass, name, spied(name))
    flight = simulate("manoeuvre", seed=1, duration_s=10.0)
    two_pass.edit(flight.log.time_s, flight.log.measurement, UNKNOWN, live=True, short=short)
    assert set(asked) == (set() if short else set(NOT_IN_SHORT_ONES))


def test_tails_of_a_short_window_are_no_wider_gate_and_its_drift_no_noise():
    """What a long log would find in the same readings."""
    flight = simulate("cruise", seed=5, duration_s=60.0, outliers="none")
    growth = np.linspace(1, 5, len(flight.log))[:, None]
    noise = flight.sigma * growth * np.random.default_rng(0).standard_normal((len(growth), 3))
    measurement = flight.clean + noise
    found = [two_pass.edit(flight.log.time_s, measurement, UNKNOWN, live=True, short=short) for short in (False, True)]
    assert [each.decision.drifts for each in found] == [True, False]
    assert [each.log.uneven is None for each in found] == [False, True]


@pytest.mark.parametrize(("kept", "rounds"), [((5, 7, 9), 2), ((5, 7, 7), 2), ((5, 5, 9), 1), ((5, 4, 9), 1)])
def test_drift_is_asked_for_again_while_more_readings_are_used(monkeypatch, kept, rounds):
    record = SimpleNamespace(possible=np.ones(10, bool))
    made = [(record, SimpleNamespace(weight=np.arange(10) < count)) for count in kept]
    rest = iter(made[1:])
    monkeypatch.setattr(two_pass, "DRIFT_ROUNDS", 2)
    monkeypatch.setattr(two_pass, "REJECTED", 1.0)
    monkeypatch.setattr(two_pass, "_with_late_stamps", lambda *_: made[0])
    monkeypatch.setattr(two_pass, "allow_for_tails", lambda *each: each)
    monkeypatch.setattr(two_pass, "allow_for_drift", lambda *_: next(rest))
    monkeypatch.setattr(two_pass, "likelier", lambda one, other: other)
    found = two_pass._examined(SimpleNamespace(white=False), made[0][1], UNKNOWN._replace(jerk_psd=1.0))
    assert found is made[rounds]


@pytest.mark.compiled
def test_noise_that_is_tenfold_for_a_third_of_a_log_is_no_outliers():
    """Of its readings most would be rejected by the noise of the rest: the rejected tell how large it is."""
    noisy = hard.make("noise", 0).simulated
    found = edit(noisy)
    assert found.decision.drifts
    assert found.weight.mean() > 0.97


@pytest.mark.parametrize(
    ("late_s", "gained", "expected"),
    [((0, 0), -99, False), ((0.01, 0.01), 99, True), ((0.01, 0), 5, True), ((0, 0.01), 5, True), ((0.01, 0), 9, False)],
)
def test_steps_must_explain_a_log_better_than_late_stamps_do(monkeypatch, late_s, gained, expected):
    seen, left = np.ones((4, 3), bool), np.ones((4, 3), bool)
    left[3] = False  # whose stamp a late clock leaves empty
    records = (decisions.Record(*[None] * 2, possible, *[None] * 6) for possible in (seen, left))
    without, bridged = (
        (record, decisions.Decision(np.ones((4, 3)), *[None] * 3, stamp_s=stamp_s))
        for record, stamp_s in zip(records, late_s, strict=True)
    )

    def probability(record, decision):
        assert (record.possible == left).all()
        assert decision is bridged[1] or (decision.weight == left).all()
        return gained if decision is bridged[1] else 0.0

    monkeypatch.setattr(settling, "log_probability", probability)
    assert settling._may_be_late_stamps(without, bridged) is expected


@pytest.mark.parametrize("live", [False, True])
def test_alternatives_are_worth_more_work_in_a_log_that_was_flown_than_in_a_live_window(monkeypatch, live):
    """A live window is soon looked at again. All hypotheses about a log, with steps and without, share the work."""
    flight, made, used = simulate("manoeuvre", seed=2, duration_s=40.0, outliers="offset=6:8-20:8-100"), [], set()

    def work(samples, at_least):
        made.append((samples, at_least, Work(samples, at_least)))
        return made[0][2]

    def search(of):
        used.add(of)
        return alternatives.Search(of)

    monkeypatch.setattr(two_pass, "Work", work)
    monkeypatch.setattr(reassessment, "alternatives", SimpleNamespace(**{**vars(alternatives), "Search": search}))
    two_pass.edit(flight.log.time_s, flight.log.measurement, UNKNOWN, live=live)
    assert [each[:2] for each in made] == [(len(flight.log), 0 if live else WORK)]
    assert used == {made[0][2]}
