"""Range rates of a radar: better with them, whatever their noise and sense, and never worse."""

from dataclasses import replace

import numpy as np
import pytest

from ftproc.correction import model_file
from ftproc.pipeline import filter_log
from ftproc.quality import summary
from ftproc.records import MISSING
from ftproc.settings import FilterSettings
from ftproc.simulation import simulate

SMOOTH = FilterSettings(smooth=True)


def true_rate(truth):
    return (truth.position_m * truth.velocity_mps).sum(1) / np.sqrt((truth.position_m**2).sum(1))


def errors(found, truth):
    """RMS of position m and velocity m/s."""
    off = (found.state[:, :3] - truth.position_m, found.state[:, 3:6] - truth.velocity_mps)
    return np.array([np.sqrt((each**2).sum(1).mean()) for each in off])


@pytest.fixture(scope="module")
def plain():
    flight = simulate("manoeuvre-clean", seed=1, duration_s=60.0)
    return flight, errors(filter_log(flight.log, SMOOTH), flight.truth)


def with_rates(flight, sigma, seed=0):
    rng = np.random.default_rng(seed)
    rate = true_rate(flight.truth) + sigma * rng.standard_normal(len(flight.log))
    return replace(flight.log, range_rate=rate)


@pytest.mark.parametrize(("sigma", "position", "velocity"), [(1.0, 0.95, 0.85), (0.3, 0.85, 0.75)])
def test_better_with_them(plain, sigma, position, velocity):
    flight, without = plain
    found = filter_log(with_rates(flight, sigma), SMOOTH)
    ratio = errors(found, flight.truth) / without
    assert ratio[0] < position
    assert ratio[1] < velocity
    part = found.metadata["summary"]["components"]["range_rate"]
    assert part["noise_mps"] == pytest.approx(sigma, rel=0.1)
    assert found.metadata["summary"]["trust"]["verdict"] == "consistent"
    assert "range_rate" in summary.text(found.metadata)


def test_useless_ones_change_nothing(plain):
    flight, without = plain
    ratio = errors(filter_log(with_rates(flight, 100.0), SMOOTH), flight.truth) / without
    assert ratio.max() < 1.02


def test_the_other_sense_is_found_by_the_motion(plain):
    flight, _ = plain
    log = with_rates(flight, 1.0)
    one, other = filter_log(log, SMOOTH), filter_log(replace(log, range_rate=-log.range_rate), SMOOTH)
    np.testing.assert_array_equal(one.state, other.state)
    assert "count inward" in " ".join(other.metadata["summary"]["remarks"])


def test_outliers_are_found(plain):
    flight, _ = plain
    log = with_rates(flight, 1.0)
    rng = np.random.default_rng(5)
    rate = log.range_rate.copy()
    bad = rng.random(len(rate)) < 0.03
    rate[bad] += rng.choice([-1, 1], bad.sum()) * rng.uniform(8, 200, bad.sum())
    bad[300:320] = True
    rate[300:320] = 500.0
    rate[50] = np.nan
    found = filter_log(replace(log, range_rate=rate), SMOOTH)
    label = np.asarray(found.extra.column("outlier_range_rate"))
    assert np.isin(label[bad & np.isfinite(rate)], (1, 2)).mean() > 0.98
    assert np.isin(label[~bad], (1, 2)).mean() < 0.005
    assert label[50] == MISSING
    assert (label[302:318] == 2).all()


def test_the_cleaned_rate_has_its_sigma(plain):
    flight, _ = plain
    found = filter_log(with_rates(flight, 1.0), SMOOTH)
    rate, sigma = (np.asarray(found.extra.column(name)) for name in ("range_rate_mps", "sigma_range_rate_mps"))
    off = np.abs(rate - true_rate(flight.truth))
    assert (off <= 3 * sigma).mean() > 0.97
    assert np.median(sigma) < 1.0


def test_rates_of_something_else_are_left_out(plain):
    flight, without = plain
    rng = np.random.default_rng(3)
    log = replace(flight.log, range_rate=np.cumsum(rng.standard_normal(len(flight.log))) + 400.0)
    found = filter_log(log, SMOOTH)
    assert (errors(found, flight.truth) / without).max() < 1.02


@pytest.mark.parametrize("seen", [lambda k, n: k % 4 == 0, lambda k, n: k < n / 3])
def test_those_of_a_part_of_the_rows_are_better_than_none(plain, seen):
    flight, without = plain
    log, n = with_rates(flight, 0.3), len(flight.log)
    rate = np.where(seen(np.arange(n), n), log.range_rate, np.nan)
    for settings, bound in ((SMOOTH, 1.0), (FilterSettings(), 1.01)):
        alone = without if settings.smooth else errors(filter_log(flight.log, settings), flight.truth)
        found = filter_log(replace(log, range_rate=rate), settings)
        assert (errors(found, flight.truth) < bound * alone).all()


@pytest.mark.parametrize(("rows", "sigma"), [(1, 0.3), (1, 1.0), (6, 1.0), (-2, 0.3)])
def test_late_ones_are_told_and_corrected(plain, rows, sigma):
    """Those that a radar stamps at the end of its dwell time, or a converter at the next row."""
    flight, without = plain
    log = with_rates(flight, sigma)
    late = np.roll(log.range_rate, rows)
    late[: max(rows, 0)] = late[len(late) + min(rows, 0) :] = np.nan
    found = filter_log(replace(log, range_rate=late), SMOOTH)
    (said,) = found.metadata["summary"]["remarks"]
    assert ("late" if rows > 0 else "early") in said
    late_s = float(said.split(" by ")[1].split(" s")[0])
    assert late_s == pytest.approx(abs(rows) * 0.05, abs=0.005)
    assert (errors(found, flight.truth) < np.array([0.97, 1.05]) * without).all()
    assert found.metadata["summary"]["trust"]["verdict"] == "consistent"


def test_late_ones_of_which_single_readings_say_little_are_corrected_too():
    """At 50 Hz the readings predict each rate well: its noise is more than seven times what is not known of it."""
    flight = simulate("family", seed=321, duration_s=120.0, outliers="none")
    log = with_rates(flight, 0.5, seed=321)
    late = np.r_[np.nan, log.range_rate[:-1]]
    found, without = filter_log(replace(log, range_rate=late), SMOOTH), filter_log(flight.log, SMOOTH)
    assert "late by 0.0" in " ".join(found.metadata["summary"]["remarks"])
    assert (errors(found, flight.truth) < errors(without, flight.truth)).all()


def test_those_in_time_are_not_moved(plain):
    flight, _ = plain
    for seed in range(3):
        assert filter_log(with_rates(flight, 0.5, seed), SMOOTH).metadata["summary"]["remarks"] == []


def test_the_network_corrects_a_filtered_log_with_rates_too(plain):
    flight, _ = plain
    log = with_rates(flight, 1.0)
    found, plainly = filter_log(log, model=model_file.named("packaged")), filter_log(log)
    assert np.abs(found.correction).max() > 0.1
    assert (errors(found, flight.truth) < errors(plainly, flight.truth)).all()


@pytest.mark.parametrize("fault", ["bias", "scale", "held", "ambiguous"])
def test_rates_that_hinder_are_left_out(plain, fault):
    """The result is that without them, and the summary says so."""
    flight, _ = plain
    log = with_rates(flight, 1.0)
    rate = log.range_rate
    wrong = {
        "bias": rate + 5.0,
        "scale": 1.02 * rate,
        "held": np.repeat(rate[::8], 8)[: len(rate)],
        "ambiguous": (rate + 25) % 50 - 25,
    }[fault]
    found = filter_log(replace(log, range_rate=wrong), SMOOTH)
    np.testing.assert_array_equal(found.state, filter_log(flight.log, SMOOTH).state)
    assert "none is used" in " ".join(found.metadata["summary"]["remarks"])


def test_a_few_are_not_used(plain):
    flight, _ = plain
    rate = np.full(len(flight.log), np.nan)
    rate[:5] = true_rate(flight.truth)[:5]
    found = filter_log(replace(flight.log, range_rate=rate), SMOOTH)
    np.testing.assert_array_equal(found.state, filter_log(flight.log, SMOOTH, None).state)
    assert "too few range rates (5)" in " ".join(found.metadata["summary"]["remarks"])
    assert "range_rate" not in found.metadata["summary"]["components"]


def test_ambiguous_ones_are_unwrapped(plain):
    flight, without = plain
    log = with_rates(flight, 0.5)
    turned = log.range_rate - 60.0 * np.round(log.range_rate / 60.0)
    assert (turned != log.range_rate).mean() > 0.5
    wrapped = replace(log, range_rate=turned, station=replace(log.station, range_rate_interval_mps=60.0))
    found, known = filter_log(wrapped, SMOOTH), filter_log(log, SMOOTH)
    np.testing.assert_allclose(errors(found, flight.truth), errors(known, flight.truth), rtol=0.02)
    assert (errors(found, flight.truth) < 0.9 * without).all()


def test_the_scenario_of_ambiguous_ones_is_as_good_as_the_other():
    both = [simulate(name, seed=2, duration_s=400.0) for name in ("radar-doppler", "radar-ambiguous")]
    assert np.nanmax(np.abs(both[1].log.range_rate)) <= 30.0
    one, other = (errors(filter_log(flight.log, SMOOTH), flight.truth) for flight in both)
    np.testing.assert_allclose(one, other, rtol=0.03)


def test_the_scenario_has_them():
    flight = simulate("radar-doppler", seed=1)
    found = filter_log(flight.log, SMOOTH)
    without = filter_log(replace(flight.log, range_rate=None), SMOOTH)
    assert (errors(found, flight.truth) <= 1.01 * errors(without, flight.truth)).all()
    assert found.metadata["summary"]["components"]["range_rate"]["noise_mps"] == pytest.approx(0.5, rel=0.15)


LIVE = FilterSettings(editing="live", lag_s=0.0)


@pytest.fixture(scope="module")
def live(plain):
    flight, _ = plain
    return filter_log(flight.log, LIVE)


@pytest.fixture(scope="module")
def live_with_rates(plain):
    flight, _ = plain
    return filter_log(with_rates(flight, 0.5), LIVE)


def causal_errors(found, truth):
    known = np.isfinite(found.state).all(1) & (found.time_s > 15)
    off = (found.state[:, :3] - truth.position_m, found.state[:, 3:6] - truth.velocity_mps)
    return np.array([np.sqrt((each[known] ** 2).sum(1).mean()) for each in off])


def test_live_is_better_with_them(plain, live, live_with_rates):
    flight, found = plain[0], live_with_rates
    ratio = causal_errors(found, flight.truth) / causal_errors(live, flight.truth)
    assert ratio[0] < 0.95
    assert ratio[1] < 0.8
    assert found.metadata["summary"]["components"]["range_rate"]["noise_mps"] == pytest.approx(0.5, rel=0.2)


def test_live_a_useless_one_changes_nothing(plain, live):
    flight, _ = plain
    found = filter_log(with_rates(flight, 100.0), LIVE)
    settled = found.time_s > 10  # before, the velocity is vague, and they do tell something of it; by it the process
    # noise of the turning force is begun from elsewhere
    np.testing.assert_allclose(found.state[settled], live.state[settled], atol=1e-3)
    turned = filter_log(replace(flight.log, range_rate=-with_rates(flight, 0.5).range_rate), LIVE)
    assert causal_errors(turned, flight.truth)[1] < 0.8 * causal_errors(live, flight.truth)[1]


def test_live_knows_no_rate_of_the_future(plain, live_with_rates):
    """Nor that the log ends."""
    flight, _ = plain
    log = with_rates(flight, 0.5)
    rate = log.range_rate[:800].copy()
    rate[700:715] += 100.0
    log = replace(log, time_s=log.time_s[:800], measurement=log.measurement[:800], row=log.row[:800], range_rate=rate)
    other = filter_log(log, LIVE)
    np.testing.assert_array_equal(live_with_rates.state[:700], other.state[:700])
    assert np.isin(np.asarray(other.extra.column("outlier_range_rate"))[700:715], (1, 2)).all()


def test_the_paper_s_recursion_has_no_rates(plain):
    flight, _ = plain
    forward = FilterSettings(editing="forward")
    one, other = (filter_log(log, forward) for log in (flight.log, with_rates(flight, 0.5)))
    np.testing.assert_array_equal(one.state, other.state)
