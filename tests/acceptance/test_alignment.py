"""The alignment experiment (tests/acceptance/reproduce/alignment.py) in small: its drive, its error model, one run."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ftproc.core.comparators import particles
from tests.acceptance.reproduce import alignment, misalignment
from tests.acceptance.reproduce.aligning import align
from tests.acceptance.reproduce.drive import DT, HZ, angles, attitude_of, drive, metres, moved, navigate


def test_drive_is_as_the_paper_says():
    driven = drive()
    assert len(driven.speed) == 600 * HZ + 1
    assert driven.speed.max() == pytest.approx(30.0)
    assert driven.speed.min() >= 0
    assert np.abs(np.diff(driven.speed)).max() / DT == pytest.approx(2.0)
    np.testing.assert_allclose(np.linalg.norm(driven.velocity, axis=1), driven.speed, atol=1e-9)


def test_sensors_without_errors_lead_along_the_drive():
    driven = drive(100)
    attitude, velocity, place = driven.attitude[0].copy(), driven.velocity[0].copy(), driven.place[0].copy()
    lever, gained = np.zeros((3, 3)), np.zeros(3)
    navigate(driven.turn, driven.push, np.zeros(3), np.zeros(3), attitude, velocity, place, lever, gained)
    np.testing.assert_allclose(attitude, driven.attitude[-1], atol=1e-10)
    np.testing.assert_allclose(velocity, driven.velocity[-1], atol=1e-7)
    np.testing.assert_allclose(metres(place, driven.place[-1]), 0, atol=1e-5)


def test_standing_still_the_sensors_feel_the_earth():
    """Gravity upwards, and the Earth's turn towards north and up."""
    driven = drive(10)
    latitude = driven.place[0, 0]
    about = driven.attitude[0] @ driven.turn[0] / DT
    np.testing.assert_allclose(about, 7.2921151467e-5 * np.array([0, np.cos(latitude), np.sin(latitude)]), atol=1e-10)
    np.testing.assert_allclose(driven.push[0] / DT, [0, 0, 9.80665 * (1 - 2 * 50 / 6378137)], atol=4e-6)


@pytest.mark.parametrize("second", [0, 15, 46, 142, 305])
def test_errors_grow_as_those_of_a_computer_that_has_them(second):
    """Large attitude errors and biases; all from two runs of the computer, with the errors and without."""
    driven, rng, k = drive(), np.random.default_rng(second), second * HZ
    scale = np.repeat([0.4, 0.3, 5.0, 1e-6, 1e-3], 3)
    for _ in range(3):
        x = scale * rng.standard_normal(15)
        attitude = Rotation.from_rotvec(x[:3]).as_matrix() @ driven.attitude[k]
        velocity, place = driven.velocity[k] + x[3:6], moved(driven.place[k], x[6:9])
        before, lever, gained = velocity.copy(), np.zeros((3, 3)), np.zeros(3)
        turn, push = driven.turn[k : k + HZ] + x[9:12] * DT, driven.push[k : k + HZ] + x[12:] * DT
        navigate(turn, push, np.zeros(3), np.zeros(3), attitude, velocity, place, lever, gained)
        passed = misalignment.Second(lever, gained, (before + velocity) / 2, place[0])
        found = misalignment.grown(x[None], passed)[0]
        phi = Rotation.from_matrix(attitude @ driven.attitude[k + HZ].T).as_rotvec()
        np.testing.assert_allclose(found[:3], phi, atol=1e-6)
        np.testing.assert_allclose(found[3:6], velocity - driven.velocity[k + HZ], atol=5e-5)
        np.testing.assert_allclose(found[6:9], metres(place, driven.place[k + HZ]), atol=1e-2)
        np.testing.assert_array_equal(found[9:], x[9:])


def test_rotations_are_those_of_scipy():
    rng = np.random.default_rng(0)
    first, phi, vectors = rng.normal(size=3), rng.normal(size=(20, 3)), rng.normal(size=(20, 3))
    phi[0], phi[1] = 0.0, 1e-9
    turned = Rotation.from_rotvec(phi)
    np.testing.assert_allclose(misalignment.turn(phi, vectors), turned.apply(vectors), atol=1e-12)
    both = (Rotation.from_rotvec(first) * turned).as_rotvec()
    np.testing.assert_allclose(misalignment.composed(first, phi), both, atol=1e-12)
    np.testing.assert_allclose(misalignment.matrix(first), Rotation.from_rotvec(first).as_matrix(), atol=1e-12)
    members = np.hstack([phi, rng.normal(size=(20, 12))])
    left = misalignment.taken_off(members, np.r_[first, np.ones(12)])
    np.testing.assert_allclose(left[:, :3], (Rotation.from_rotvec(-first) * turned).as_rotvec(), atol=1e-12)
    np.testing.assert_allclose(left[:, 3:], members[:, 3:] - 1)


def test_angles_of_an_attitude():
    wanted = np.array([0.2, -0.3, 2.5])
    np.testing.assert_allclose(angles(attitude_of(*wanted)), wanted)


@pytest.mark.parametrize("name", ["enkf", "renpf"])
def test_a_minute_is_enough_for_a_coarse_alignment(name, monkeypatch):
    """From 10, -10 and 30 degrees; with an outlier after 50 s, which renpf does not use."""
    monkeypatch.setattr("tests.acceptance.reproduce.aligning.OUTLIER_TIMES_S", (50,))
    run = align(drive(60), particles.UPDATES[name], 150, 1, outliers=True)
    assert np.abs(run.attitude[0]).max() > 10
    assert (np.abs(run.attitude[-1]) < [0.1, 0.1, 1.0]).all()
    assert run.rho[49] > 50
    assert run.gamma[49] == (1.0 if name == "enkf" else 0.0)
    assert np.median(run.rho[30:49]) < 10


def test_report_and_plots_of_a_few_runs(tmp_path):
    """A short run standing for all of them."""
    pytest.importorskip("matplotlib")
    run = align(drive(30), particles.UPDATES["enkf"], 20, 0, outliers=False)
    run = run._replace(attitude=np.resize(run.attitude, (600, 3)), rho=np.resize(run.rho, 600), gamma=np.ones(600))
    both = (alignment.PAPER_MEMBERS, alignment.ENOUGH_MEMBERS)
    runs = {(name, n, bad): [run, run] for name in alignment.FILTERS for n in both for bad in (False, True)}
    text = alignment.report(runs, 12.0)
    assert text.startswith("## Alignment of a strapdown system on the move")
    assert text.count("| renpf | 100 |") == 2
    assert "All runs of this section took 12 s." in text
    assert text.count("holds |") + text.count("does not hold** |") == len(alignment.claims(runs))
    alignment.plots.draw(tmp_path, runs, alignment.ENOUGH_MEMBERS, alignment.PAPER_GATE)
    shown = {line.split("(")[1].rstrip(")") for line in text.splitlines() if line.startswith("![")}
    assert shown == {path.name for path in tmp_path.iterdir()}
    assert all(path.stat().st_size > 10_000 for path in tmp_path.iterdir())
