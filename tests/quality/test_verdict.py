"""The verdict, for one fault at a time."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import replace

import numpy as np
import pyarrow as pa
import pytest

from ftproc import pipeline
from ftproc.files.reading import logs
from ftproc.quality import summary, verdict
from ftproc.quality.verdict import CONSISTENT, SUSPECT, UNRELIABLE
from ftproc.settings import FilterSettings
from tests.simulated import simulate


@pytest.fixture(scope="module")
def good():
    return pipeline.filter_log(simulate("manoeuvre", seed=5, duration_s=60.0).log).metadata["summary"]


def judged(good, part=None, **changes):
    """The verdict with these figures, or these of the range, changed."""
    figures = deepcopy(dict(good)) | changes
    figures["components"]["range"] |= part or {}
    return verdict.verdict(verdict.remarks(figures))


def test_the_words_of_the_contract(good):
    assert verdict.LEVELS == ("consistent", "suspect", "unreliable")
    assert judged(good) == {"verdict": "consistent", "reasons": [], "not_shown": verdict.NOT_SHOWN} == good["trust"]
    assert verdict.sentence(good["trust"]) == (
        "consistent: residuals agree with the published sigmas, and no fault shows"
    )


LARGE = [{"from_s": 3.0, "to_s": 5.0, "sigma_m": 80.0}, {"from_s": 7.0, "to_s": 8.0, "sigma_m": 90.0}]
CAUTIOUS = {"innovation_ratio": 0.4, "innovation_bounds": [0.8, 1.2], "verdict": "cautious"}
OFF = {"innovation_ratio": 1.5, "innovation_bounds": [0.8, 1.2], "verdict": "overconfident"}


@pytest.mark.parametrize(
    ("changes", "part", "level", "reason"),
    [
        ({}, OFF, SUSPECT, "range innovations are 1.5 times their predicted sigma: the published sigmas are too small"),
        ({}, OFF | {"innovation_ratio": 2.5}, UNRELIABLE, "range innovations are 2.5 times their predicted sigma"),
        ({}, CAUTIOUS | {"innovation_ratio": 0.6}, CONSISTENT, None),
        ({}, CAUTIOUS, SUSPECT, "range innovations are 0.4 times their predicted sigma: the published sigmas are too "
                                "large; noise and motion cannot be told apart at this rate"),
        ({"specified_noise": ["range"]}, CAUTIOUS, CONSISTENT, None),
        ({}, {"good": 15, "isolated": 0, "patch": 0}, SUSPECT, "too few good range readings (15) to test the sigmas"),
        ({}, {"good": 60, "patch": 40, "isolated": 0}, SUSPECT, "40 % of the range readings are rejected as outliers"),
        ({}, {"good": 60, "patch": 40, "isolated": 40}, UNRELIABLE, "57 % of the range readings are rejected"),
        ({}, {"predicted_sigma_ratio": 9.0}, SUSPECT, "range is poorly observable: its predicted sigma is 9 times"),
        ({"slow_noise_s": 3.0, "slow_noise_likelier": True}, {}, UNRELIABLE, "over 3 s explains the log better than"),
        ({"slow_noise_s": 3.0}, {}, CONSISTENT, None),
        ({"slow_noise_s": 3.0, "slow_noise_separable": False}, {}, SUSPECT,
         "noise that is correlated over 3 s explains the log as well as motion"),
        ({"not_observable": ["elevation"]}, {}, CONSISTENT, None),
        ({"not_observable": ["elevation"], "slow_noise_s": 3.0, "slow_noise_likelier": True}, {}, SUSPECT, "over 3 s"),
        ({"not_observable": ["elevation"], "sigmas_published": False}, {}, SUSPECT, "publishes no sigmas"),
        ({"poorly_observable_readings": {"azimuth": [{"from_s": 3.0, "to_s": 5.0, "sigma_rad": 0.002}]}}, {}, SUSPECT,
         "the azimuth is poorly observable from 3 to 5 s: 1 sigma up to 2 mrad"),
        ({"poorly_observable": LARGE[:1]}, {}, SUSPECT, "the position is poorly observable from 3 to 5 s: 1 sigma up "
                                                        "to 80 m"),
        ({"poorly_observable": [{**LARGE[0], "to_s": 3.0}]}, {}, SUSPECT, "the position is poorly observable at 3 s"),
        ({"poorly_observable": LARGE}, {}, SUSPECT, "the position is poorly observable in 2 intervals: 1 sigma up to "
                                                    "90 m, from 7 to 8 s"),
        ({"sigmas_published": False}, {}, SUSPECT, "the method publishes no sigmas, so nothing tests its estimate"),
        ({"editing_converged": False}, {}, SUSPECT, "did not converge"),
        ({"editing_places_unexamined": 3}, {}, SUSPECT, "cut short: 3 places were not examined"),
        ({"editing_places_unexamined": 1}, {}, SUSPECT, "cut short: 1 place was not examined"),
        ({"reacquired": 1}, {}, SUSPECT, "re-initialized once (track loss, or a gap too long to bridge)"),
        ({"reacquired": 2}, {}, SUSPECT, "re-initialized twice (track loss"),
        ({"reacquired": 3}, {}, SUSPECT, "re-initialized 3 times (track loss"),
        ({"left_behind": [{"component": "range", "from_s": 3.0, "to_s": 9.0, "sigmas": 12.0}]}, {}, UNRELIABLE,
         "from 3 to 9 s most range readings lie 12 sigmas or more from the estimate"),
        ({"left_behind": []}, {}, CONSISTENT, None),
        ({"acceleration_at_least_mps2": 999.0}, {}, CONSISTENT, None),
        ({"acceleration_at_least_mps2": 2540.0}, {}, SUSPECT, "the readings ask for an acceleration of 2.54e+03 m/s2"),
        ({"correction_largest_m": 2.0, "correction_largest_sigma": 4.9}, {}, CONSISTENT, None),
        ({"correction_largest_m": 2.0, "correction_largest_sigma": 5.1}, {}, SUSPECT, "up to 2 m, 5.1 sigma: more"),
    ],
)  # fmt: skip
def test_one_fault(good, changes, part, level, reason):
    found = judged(good, part, **changes)
    assert found["verdict"] == level
    if reason is None:
        assert found["reasons"] == []
    else:
        (given,) = found["reasons"]
        assert reason in given
        assert verdict.sentence(found) == f"{level}: {given}"


@pytest.mark.parametrize("samples", [30, 300, 3000])
def test_readings_at_chance_are_no_flight(samples):
    rng = np.random.default_rng(samples)
    chance = {"range_m": (1e3, 2e4), "azimuth_rad": (-3.0, 3.0), "elevation_rad": (0.0, 1.5)}
    columns = {name: rng.uniform(*limits, samples) for name, limits in chance.items()}
    found = pipeline.filter_log(logs.read(pa.table({"time_s": 0.1 * np.arange(samples), **columns})))
    assert found.metadata["summary"]["trust"]["verdict"] == UNRELIABLE
    assert "readings at chance" in str(found.metadata["summary"]["trust"]["reasons"])


def test_the_worst_level_decides_and_gives_the_reasons(good):
    few = {"good": 3, "isolated": 0, "patch": 0}
    found = judged(good, few, slow_noise_s=3.0, slow_noise_likelier=True, reacquired=4)
    assert found["verdict"] == UNRELIABLE
    assert len(found["reasons"]) == 1
    assert len(judged(good, few, reacquired=4)["reasons"]) == 2


def test_several_reasons_have_a_line_each():
    flight = simulate("manoeuvre", seed=3, duration_s=30.0)
    noise = (0.3, 1e-5, 1e-5)
    trajectory = pipeline.filter_log(flight.log, FilterSettings(editing="none", noise=noise, jerk_psd_m2ps5=1.0))
    lines = summary.text(trajectory.metadata).splitlines()
    at = lines.index("  verdict    unreliable:")
    assert [line.split()[1] for line in lines[at + 1 : -1]] == ["range", "azimuth", "elevation"]
    assert all(line.startswith("             - ") for line in lines[at + 1 : -1])
    assert lines[-1] == "  next       leave --editing and --noise and --jerk out"


def test_a_component_with_too_large_sigmas_is_named_by_a_consistent_verdict(good):
    """The table calls it cautious; so does the verdict."""
    figures = deepcopy(dict(good))
    for name in ("range", "elevation"):
        figures["components"][name] |= CAUTIOUS | {"innovation_ratio": 0.6}
    found = verdict.verdict(verdict.remarks(figures), verdict.too_wide(figures))
    assert verdict.sentence(found) == (
        "consistent: range and elevation residuals are smaller than the published sigmas, which are cautious, "
        "and no fault shows"
    )
    figures["components"]["azimuth"] |= CAUTIOUS | {"innovation_ratio": 0.6}
    found = verdict.verdict(verdict.remarks(figures), verdict.too_wide(figures))
    assert found["verdict"] == SUSPECT
    assert len(found["reasons"]) == 3


@pytest.mark.parametrize("missing", [[0], [1, 2]], ids=["angles only", "range only"])
@pytest.mark.parametrize("settings", [{}, {"smooth": True}, {"editing": "none"}, {"method": "ekf"}], ids=str)
def test_a_log_of_some_components_is_judged_by_these(missing, settings):
    flight = simulate("manoeuvre-clean", seed=5, duration_s=60.0)
    z = flight.log.measurement.copy()
    z[:, missing] = np.nan
    found = pipeline.filter_log(replace(flight.log, measurement=z), FilterSettings(**settings)).metadata
    assert found["summary"]["trust"]["verdict"] == CONSISTENT, found["summary"]["trust"]
    seen = "azimuth and elevation" if missing == [0] else "range"
    assert f"are not observable and left empty; the verdict is about the {seen}" in summary.text(found)
    assert found["summary"]["nis_mean"] == pytest.approx(found["summary"]["components_used_mean"], rel=0.15)


def test_where_an_angle_is_hardly_known_is_said_of_a_log_of_angles():
    flight = simulate("manoeuvre-clean", seed=4, duration_s=60.0, dt_s=0.1)
    flight.log.measurement[:, 0] = np.nan
    flight.log.measurement[200:500, 1] = np.nan
    trust = pipeline.filter_log(flight.log).metadata["summary"]["trust"]
    assert trust["verdict"] == SUSPECT
    assert trust["reasons"][0].startswith("the azimuth is poorly observable from 2")
    assert trust["reasons"][0].endswith(" mrad")


@pytest.mark.parametrize("method", ["gate", "ls4", "rkf"])
def test_a_method_without_sigmas_is_never_consistent(method):
    flight = simulate("zuo2021", seed=1)
    found = pipeline.filter_log(flight.log, FilterSettings(method=method)).metadata["summary"]
    assert not found["sigmas_published"]
    assert found["trust"]["verdict"] == SUSPECT
    assert "not_shown" not in found["trust"]


def test_a_consistent_run_says_what_one_log_cannot_show():
    flight = simulate("manoeuvre-clean", seed=5, duration_s=30.0)
    lines = summary.text(pipeline.filter_log(flight.log).metadata).splitlines()
    assert lines[-3].split()[:2] == ["verdict", "consistent:"]
    assert lines[-2].strip() == verdict.NOT_SHOWN
    assert lines[-1].split()[0] == "better"


def test_the_verdict_against_the_truth():
    """A consistent run has its errors inside its sigmas; a filter without editing on a dirty log is unreliable."""
    flight = simulate("manoeuvre", seed=5, duration_s=60.0)
    edited = pipeline.filter_log(flight.log)
    error = np.abs(edited.state[:, :3] - flight.truth.position_m)
    assert edited.metadata["summary"]["trust"]["verdict"] == CONSISTENT
    assert (error < 3 * edited.sigma[:, :3]).all(1).mean() > 0.97
    plain = pipeline.filter_log(flight.log, FilterSettings(method="ukf"))
    assert plain.metadata["summary"]["trust"]["verdict"] == UNRELIABLE
