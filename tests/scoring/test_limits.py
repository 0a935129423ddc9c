"""Limits: every form against figures counted by hand, and every wrong file refused with its place."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.errors import UsageError
from ftproc.scoring import limits, named
from ftproc.scoring.matching import match
from tests.simulated import flown, trajectory_for

TRUTH = flown(outliers="none")
TRAJECTORY = trajectory_for(TRUTH, error_m=3.0)
ERRORS = named.errors(TRAJECTORY, match(TRAJECTORY.time_s, TRUTH))


def written(tmp_path, text):
    path = tmp_path / "limits.toml"
    path.write_text(text)
    return limits.load(str(path))


def judged(tmp_path, line):
    (result,) = limits.judge(TRAJECTORY, TRUTH, written(tmp_path, f"[[require]]\n{line}").limits)
    return result


def known(name):
    return ERRORS[name][np.isfinite(ERRORS[name])]


def test_a_share_of_the_rows(tmp_path):
    error = known("position horizontal")
    bound = float(np.quantile(error, 0.9))
    line = f'what = "position horizontal"\nbelow_m = {bound}\nshare = '
    result = judged(tmp_path, f"{line}0.89")
    assert result.found == pytest.approx((error <= bound).mean())
    assert result.verdict == "PASS"
    assert judged(tmp_path, f"{line}0.92").verdict == "FAIL"


@pytest.mark.parametrize("name", ["position", "position across", "velocity x", "range"])
@pytest.mark.parametrize("kind", ["rms", "bias", "sigma"])
def test_rms_bias_and_sigma(tmp_path, name, kind):
    error = known(name)
    expected = {"rms": np.sqrt((error**2).mean()), "bias": abs(error.mean()), "sigma": error.std()}[kind]
    line = f'what = "{name}"\n{kind}_below_{named.unit(name)} = '
    assert judged(tmp_path, f"{line}{1.01 * expected}").passed is True
    assert judged(tmp_path, f"{line}{0.99 * expected}").passed is False
    assert judged(tmp_path, f"{line}1.0").found == pytest.approx(expected)


def test_sigmas_and_estimate(tmp_path):
    inside = judged(tmp_path, 'what = "position"\nshare = 0.5\ninside_sigmas = 3')
    ratio = named.in_sigmas(named.vector(ERRORS, "position"), TRAJECTORY.sigma[:, :3])
    ratio = ratio[np.isfinite(ratio).all(1)]
    assert inside.found == pytest.approx((np.abs(ratio) <= 3).all(1).mean())
    there = judged(tmp_path, 'what = "estimate"\nshare = 0.5')
    assert there.found == pytest.approx(np.isfinite(TRAJECTORY.state[:, 0]).mean())


def test_what_cannot_be_measured_is_not_met(tmp_path):
    nothing = trajectory_for(TRUTH, state=np.full((len(TRUTH), 9), np.nan))
    asked = written(tmp_path, '[[require]]\nwhat = "velocity"\nrms_below_mps = 5').limits
    results = limits.judge(nothing, TRUTH, asked)
    assert results[0].verdict == "no data"
    assert not limits.passed(results)
    assert "FAIL: 1 of 1" in limits.text("a", limits.Limits("t", "", asked), results)


@pytest.mark.parametrize("name", limits.standards())
def test_the_standards_can_be_read_and_name_their_source(name):
    found = limits.load(name)
    assert limits.load(name.upper()) == found
    assert found.source
    assert found.title
    assert len(limits.judge(TRAJECTORY, TRUTH, found.limits)) == len(found.limits)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a = ", "not TOML"),
        ("title = 'x'", "no limit"),
        ("[[require]]\nshare = 0.9", "number 1: it has no what"),
        ("[[require]]\nwhat = 'height'\nshare = 0.9", "none of position"),
        ("[[require]]\nwhat = 'position'\nshare = 95\nbelow_m = 1", "write 0.95"),
        ("[[require]]\nwhat = 'position'\nbelow_m = 1", "needs a share"),
        ("[[require]]\nwhat = 'position'\nshare = 0.9", "takes one of"),
        ("[[require]]\nwhat = 'position'\nshare = 0.9\nbelow_ft = 1", "has below_ft"),
        ("[[require]]\nwhat = 'position'\nshare = 0.9\nrms_below_m = 1", "takes no share"),
        ("[[require]]\nwhat = 'position'\nshare = 0.9\nbelow_m = 'ten'", "not a number above zero"),
        ("[[require]]\nwhat = 'position'\nshare = 0.9\nbelow_m = nan", "not a number above zero"),
        ("[[require]]\nwhat = 'estimate'\nshare = 0.9\nbelow_m = 1", "its share only"),
        ("require = 3", "no limit"),
    ],
)
def test_a_wrong_file_is_refused_with_the_place(tmp_path, text, said):
    with pytest.raises(UsageError, match=said):
        written(tmp_path, text)


def test_an_unknown_name_lists_the_standards():
    with pytest.raises(UsageError, match="ed-117a"):
        limits.load("ed-999")
