"""Verdicts on a summary, one doubt at a time."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest

from ftproc import pipeline
from ftproc.quality import summary, verdict
from ftproc.settings import FilterSettings
from tests.simulated import simulate


@pytest.fixture(scope="module")
def good():
    return pipeline.filter_log(simulate("manoeuvre", seed=5, duration_s=60.0).log).metadata["summary"]


def judged(good, part=None, **changes):
    """The verdict when this, or this of the range, were so."""
    figures = deepcopy(dict(good)) | changes
    figures["components"]["range"] |= part or {}
    return verdict.verdict(verdict.remarks(figures))


def test_nothing_in_doubt(good):
    assert judged(good) == {"verdict": "trust", "reasons": []}
    assert good["trust"] == judged(good)
    assert verdict.sentence(good["trust"]) == (
        "Trust it: readings are no farther off than the sigmas say, and nothing else is in doubt."
    )


BLIND = [{"from_s": 3.0, "to_s": 5.0, "sigma_m": 80.0}, {"from_s": 7.0, "to_s": 8.0, "sigma_m": 90.0}]
OFF = {"innovation_ratio": 1.5, "innovation_bounds": [0.8, 1.2], "verdict": "overconfident"}


@pytest.mark.parametrize(
    ("changes", "part", "level", "reason"),
    [
        ({}, OFF, "be careful", "range readings are 1.5 times as far off as the filter says: its sigmas are too small"),
        ({}, OFF | {"innovation_ratio": 2.5}, "do not trust", "range readings are 2.5 times as far off"),
        ({}, {"verdict": "cautious", "innovation_ratio": 0.4}, "trust", None),
        ({}, {"good": 19, "isolated": 0, "patch": 0}, "be careful", "19 good readings of range are too few to judge"),
        ({}, {"good": 60, "patch": 40, "isolated": 0}, "be careful", "40 % of the range readings are called outliers"),
        ({}, {"good": 60, "patch": 40, "isolated": 40}, "do not trust", "57 % of the range readings are called"),
        ({}, {"prediction_vagueness": 9.0}, "be careful", "the range gate can hardly fire"),
        ({"slow_noise": True}, {}, "do not trust", "correlated so slowly that it passes for motion"),
        ({"slow_noise": True, "not_observable": ["elevation"]}, {}, "be careful", "elevation missing throughout"),
        ({"hardly_observable": BLIND[:1]}, {}, "be careful", "from 3 to 5 s the position is hardly observable"),
        (
            {"hardly_observable": [{**BLIND[0], "to_s": 3.0}]}, {}, "be careful",
            "at 3 s the position is hardly observable",
        ),
        ({"hardly_observable": BLIND}, {}, "be careful", "in 2 stretches the position is hardly observable: 1 sigma up "
                                                         "to 90 m, most of all from 7 to 8 s"),
        ({"editing_settled": False}, {}, "be careful", "did not settle"),
        ({"reacquired": 1}, {}, "be careful", "the track was taken up anew once (lost"),
        ({"reacquired": 2}, {}, "be careful", "the track was taken up anew 2 times (lost"),
        ({"correction_largest_m": 2.0}, {}, "trust", None),
    ],
)  # fmt: skip
def test_one_doubt(good, changes, part, level, reason):
    found = judged(good, part, **changes)
    assert found["verdict"] == level
    if reason is None:
        assert found["reasons"] == []
    else:
        (said,) = found["reasons"]
        assert reason in said
        opening = {"be careful": "Be careful", "do not trust": "Do not trust it"}[level]
        assert verdict.sentence(found) == f"{opening}: {said}."


def test_the_worst_decides_and_gives_the_reasons(good):
    few = {"good": 3, "isolated": 0, "patch": 0}
    found = judged(good, few, slow_noise=True, reacquired=4)
    assert found["verdict"] == "do not trust"
    assert len(found["reasons"]) == 1
    assert len(judged(good, few, reacquired=4)["reasons"]) == 2


def test_several_reasons_stand_below_each_other():
    flight = simulate("manoeuvre", seed=3, duration_s=30.0)
    noise = (0.3, 1e-5, 1e-5)
    trajectory = pipeline.filter_log(flight.log, FilterSettings(editing="none", noise=noise, jerk_psd_m2ps5=1.0))
    lines = summary.text(trajectory.metadata).splitlines()
    at = lines.index("  verdict    Do not trust it:")
    assert [line.split()[1] for line in lines[at + 1 :]] == ["range", "azimuth", "elevation"]
    assert all(line.startswith("             - ") for line in lines[at + 1 :])


def test_honest_verdict_against_truth():
    """What is trusted has errors inside its sigmas; a filter that edits nothing is not trusted on a dirty log."""
    flight = simulate("manoeuvre", seed=5, duration_s=60.0)
    trusted = pipeline.filter_log(flight.log)
    error = np.abs(trusted.state[:, :3] - flight.truth.position_m)
    assert trusted.metadata["summary"]["trust"]["verdict"] == "trust"
    assert (error < 3 * trusted.sigma[:, :3]).all(1).mean() > 0.97
    plain = pipeline.filter_log(replace(flight.log), FilterSettings(method="ukf"))
    assert plain.metadata["summary"]["trust"]["verdict"] == "do not trust"
