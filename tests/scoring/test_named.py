"""Errors along track, across and vertical, and their spread."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ftproc.records import Truth
from ftproc.scoring import named, score
from ftproc.scoring.matching import match
from ftproc.scoring.named import Spread
from tests.simulated import flown, trajectory_for


def straight(heading_rad: float, n: int = 50, velocity: bool = True) -> Truth:
    """A level flight at 100 m/s; heading: from x towards y."""
    time_s = np.arange(n) / 2
    along = np.array([np.cos(heading_rad), np.sin(heading_rad), 0.0])
    position = 100 * time_s[:, None] * along + [5000.0, 2000.0, 1000.0]
    return Truth("straight", time_s, position, np.tile(100 * along, (n, 1)) if velocity else None)


def off_by(truth: Truth, shift: list[float], frame: str = "local"):
    exact = trajectory_for(truth, error_m=0.0, metadata={"frame": frame})
    state = exact.state.copy()
    state[:, :3] = truth.position_m + shift
    return replace(exact, state=state)


@pytest.mark.parametrize("velocity", [True, False])
@pytest.mark.parametrize(
    ("heading", "frame", "shift", "along", "across"),
    [
        (0.0, "local", [3.0, -4.0, 1.0], 3.0, 4.0),  # x is ahead, -y to the right
        (np.pi / 2, "local", [4.0, 3.0, 1.0], 3.0, 4.0),
        (0.0, "north-east-up", [3.0, 4.0, 1.0], 3.0, 4.0),  # north is ahead, east to the right
        (np.pi, "north-east-up", [-3.0, -4.0, 1.0], 3.0, 4.0),
    ],
)
def test_along_is_ahead_and_across_to_the_right(heading, frame, shift, along, across, velocity):
    truth = straight(heading, velocity=velocity)
    found = named.errors(trajectory := off_by(truth, shift, frame), match(trajectory.time_s, truth))
    np.testing.assert_allclose(found["position along"], along, atol=1e-6)
    np.testing.assert_allclose(found["position across"], across, atol=1e-6)
    np.testing.assert_allclose(found["position vertical"], 1.0)
    np.testing.assert_allclose(found["position horizontal"], 5.0)
    np.testing.assert_allclose(found["position"], np.sqrt(26))


def test_a_target_at_rest_has_no_side():
    truth = replace(straight(0.0), velocity_mps=np.zeros((50, 3)))
    found = named.errors(trajectory := off_by(truth, [1.0, 0.0, 0.0]), match(trajectory.time_s, truth))
    assert np.isnan(found["position along"]).all()
    assert np.isfinite(found["position horizontal"]).all()


def test_spread_is_bias_and_deviation_about_it():
    error = np.array([1.0, 3.0, np.nan, 2.0, 2.0])
    spread = Spread.of(error)
    assert spread == Spread(2.0, np.sqrt(0.5), np.sqrt(4.5), pytest.approx(2.85), 3.0)
    assert Spread.of(np.full(3, np.nan)) is None


def test_every_name_has_a_unit_and_the_score_its_figures():
    truth = flown(outliers="none")
    trajectory = trajectory_for(truth)
    found = named.errors(trajectory, match(trajectory.time_s, truth))
    assert set(found) <= set(named.names())
    assert all(named.unit(name) in ("m", "mps", "mps2", "rad") for name in named.names())
    figures = score(trajectory, truth).as_dict()
    assert figures["path"]["position_along_m"]["rms"] == pytest.approx(
        np.sqrt(np.nanmean(found["position along"] ** 2))
    )
    assert set(figures["channels"]) == {"range_m", "azimuth_rad", "elevation_rad"}
