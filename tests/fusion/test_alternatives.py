"""A flight that is continued into a place: as far as there are readings, not second by second."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ftproc.fusion.estimation import alternatives, screening

REACH_S = 2.0


class Way:
    """Decisions that are counted, and follow from those before: they change with each, or settle at once."""

    def __init__(self, settles: bool) -> None:
        self.count, self.settles = 0, settles

    def of(self, weight: Any) -> tuple[None, Any]:
        self.count += 1
        drawn = np.random.default_rng(int(weight.sum())).random(weight.shape) < 0.5
        return None, np.ones_like(weight) if self.settles else drawn.astype(float)


def near(time_s: Any) -> Any:
    inside = np.ones(len(time_s), bool)
    inside[[0, -1]] = False
    return SimpleNamespace(
        log=SimpleNamespace(time_s=time_s, weight=np.ones((len(time_s), 3))), inside=inside, reach_s=REACH_S
    )


def naive(place: Any, way: Way) -> Any:
    """A few seconds at a time, whatever comes in them."""
    time_s, inside = place.log.time_s, place.inside
    first, last = time_s[inside][0], time_s[inside][-1]
    depth_s, weight = 0.0, np.where(inside[:, None], 0.0, place.log.weight)
    while first + depth_s < last - depth_s:
        depth_s += REACH_S
        reached = inside & ((time_s < first + depth_s) | (time_s > last - depth_s))
        weight = np.where(reached[:, None], way.of(weight)[1], weight)
    return weight


@pytest.mark.parametrize("settles", [True, False])
@pytest.mark.parametrize("gap_s", [0.0, 1.0, 7.3, 20.0])
def test_usual_logs_are_continued_second_by_second(settles: bool, gap_s: float) -> None:
    time_s = 0.1 * np.arange(400) + gap_s * (np.arange(400) > 170)
    place = near(time_s)
    np.testing.assert_array_equal(alternatives._continued(place, Way(settles)), naive(place, Way(settles)))  # type: ignore[arg-type]


@pytest.mark.parametrize("settles", [True, False])
@pytest.mark.parametrize("far", [np.r_[0.0, 1e9], np.r_[0.0, np.full(9, 1e10)], 1e7 * np.arange(30.0)])
def test_years_without_readings_are_passed_at_once(settles: bool, far: Any) -> None:
    time_s = np.sort(np.concatenate([0.1 * np.arange(100), far, far + 0.1]))
    way = Way(settles)
    alternatives._continued(near(time_s), way)  # type: ignore[arg-type]
    assert way.count < (alternatives.IDLE + 2) * len(time_s)


def test_the_interval_of_stations_that_repeat_times_is_not_zero() -> None:
    def seen(time_s: Any) -> Any:
        return SimpleNamespace(time_s=np.asarray(time_s))

    assert screening.interval([seen([0.0, 0.1, 0.2]), seen([0.0, 5.0])]) == pytest.approx(0.1)
    assert screening.interval([seen(np.zeros(50)), seen([0.0, 5.0])]) == 1.0
    assert screening.interval([seen(np.r_[np.zeros(50), 0.2, 0.4]), seen([0.0, 5.0])]) == pytest.approx(0.2)
