"""The outliers of a simulated log are those of the specification, and the truth has their codes."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.model.frames import from_cartesian, wrap
from ftproc.records import FloatArray
from ftproc.simulation import Fault, OutlierSpec, Simulation, contamination, simulate
from ftproc.simulation.contamination import contaminate
from ftproc.simulation.outlier_spec import COPIED, SHAPED
from ftproc.simulation.sampling import kept_rows, sample_times, with_duplicates
from tests.simulated import codes, deviation, runs


@pytest.mark.parametrize(
    ("spec", "code"),
    [
        ("isolated=0.1:20-200", 1),
        ("offset=3:4-30:8-60", 2),
        ("ramp=3:4-30:8-60", 3),
        ("stuck=3:4-30", 4),
        ("burst=3:4-30:8-60", 5),
        ("start=6:50", 6),
        ("zero=0.05", 7),
        ("all.offset=2", 2),
        ("all.isolated=0.1", 1),
    ],
)
def test_flags_match_what_was_injected(spec: str, code: int) -> None:
    flight = simulate("manoeuvre", seed=4, outliers=spec)
    flag, off = codes(flight), deviation(flight)
    assert set(np.unique(flag)) == {0, code}
    assert (off[flag == 0] == 0).all()
    changed = off != 0
    assert changed[flag != 0].mean() > 0.99  # the first reading after a stuck start may be equal
    if spec.startswith("all."):
        assert ((flag != 0).all(axis=1) == (flag != 0).any(axis=1)).all()
    else:
        assert ((flag != 0).all(axis=1) != (flag != 0).any(axis=1)).any() or code == 6


def test_every_kind_of_patch_has_a_shape_and_a_code() -> None:
    assert set(SHAPED) == {*contamination.SHAPES, *contamination.DRAWN}
    assert set(COPIED) == set(contamination.COPIES)
    kinds = {kind for drawn in contamination.DRAWN.values() for kind in drawn}
    assert kinds <= {*contamination.SHAPES, *contamination.COPIES} < set(contamination.CODES)
    assert list(contamination.CODES.values()) == list(range(1, 19))


def only_patch(spec: str) -> tuple[slice, Simulation]:
    flight = simulate("manoeuvre", seed=5, outliers=spec)
    (patch,) = runs(codes(flight).any(axis=1))
    return patch, flight


def in_sigmas(kind: str, spec: str = "1:10s:8-60") -> FloatArray:
    patch, flight = only_patch(f"azimuth.{kind}={spec}")
    assert patch.stop - patch.start == 200
    assert (codes(flight)[patch, 1] == contamination.CODES[kind]).all()
    return np.asarray(deviation(flight)[patch, 1] / flight.sigma[1])


def test_shapes_of_long_patches() -> None:
    k = np.arange(1, 201) / 200
    walkoff, sine, lobes, other = (in_sigmas(kind) for kind in ("walkoff", "sine", "sidelobe", "other"))
    assert 8 <= abs(walkoff[-1]) <= 60
    np.testing.assert_allclose(walkoff, walkoff[-1] * k**2, atol=1e-6)
    assert 8 <= np.abs(sine).max() <= 60
    assert (np.diff(np.sign(sine[np.abs(sine) > 1e-6])) != 0).sum() in (3, 5, 7, 9, 11)
    assert {round(abs(a / b), 6) for a in lobes for b in lobes} <= {0.5, 1.0, 2.0}
    assert (np.diff(lobes) != 0).sum() <= 2
    np.testing.assert_allclose(np.diff(other, 3), 0, atol=1e-6)
    assert 7 < abs(other[0]) < 65


def test_copies_of_readings() -> None:
    for kind in ("mirror", "replay", "swap"):
        patch, flight = only_patch(f"all.{kind}=1:5s")
        clean, found = flight.clean[:, 0], flight.log.measurement[:, 0]
        own, n = clean[patch], patch.stop - patch.start
        made = {
            "mirror": 2 * clean[patch.start - 1] - own,
            "replay": clean[patch.start - n : patch.start],
            "swap": np.concatenate([own[n - n // 2 :], own[: n - n // 2]]),
        }
        np.testing.assert_allclose(found[patch], made[kind], rtol=1e-12)


def test_a_patch_at_an_end_and_one_as_long_as_a_share_of_the_log() -> None:
    assert only_patch("range.ramp=1:5s@start")[0] == slice(0, 100)
    assert only_patch("range.stuck=1:5s@end")[0] == slice(2301, 2401)
    patch, _ = only_patch("all.other=1:25%")
    assert patch.stop - patch.start == 600


def test_components_are_drawn_each_time() -> None:
    for prefix, hit in (("one", 1), ("two", 2), ("azimuth+elevation", 2)):
        flight = simulate("manoeuvre", seed=5, outliers=f"{prefix}.offset=6:10-40")
        together = (codes(flight) != 0).sum(axis=1)
        assert set(together) == {0, hit}
    one = codes(simulate("manoeuvre", seed=5, outliers="one.offset=6:10-40")).any(axis=0)
    assert one.sum() > 1


@pytest.mark.parametrize("seed", range(6))
def test_a_step_lasts_to_the_nearer_end_and_leaves_what_is_hit_already(seed: int) -> None:
    spec = "elevation.step=1:20,elevation.zero=0.2,elevation.isolated=0.1"
    flight = simulate("manoeuvre", seed=seed, outliers=spec)
    code, off = codes(flight)[:, 2], deviation(flight)[:, 2] / flight.sigma[2]
    first, last = np.flatnonzero(code == 9)[[0, -1]]
    assert (code[first : last + 1] != 0).all()
    assert 0.1 * len(code) < last - first < 0.51 * len(code)
    assert min(first, len(code) - last) < 20
    np.testing.assert_allclose(np.abs(off[code == 9]), 20, rtol=1e-6)
    assert (flight.log.measurement[code == 7, 2] == 0).all()


def test_noise_that_changes_has_no_code_and_is_in_the_clean_readings() -> None:
    usual = simulate("manoeuvre", seed=5, outliers="none")
    loud = simulate("manoeuvre", seed=5, outliers="noise=1:33%:10")
    quiet = simulate("manoeuvre", seed=5, outliers="range.noise=1:100%:0")
    exact = from_cartesian(usual.truth.position_m)
    assert not codes(loud).any()
    assert (loud.log.measurement == loud.clean).all()
    for c in (0, 2):
        ratio = (loud.clean - exact)[:, c] / (usual.clean - exact)[:, c]
        (where,) = runs(np.abs(ratio - 10) < 1e-3)
        assert where.stop - where.start == 792
        np.testing.assert_allclose(np.delete(ratio, np.r_[where]), 1, rtol=1e-3)
    np.testing.assert_allclose(quiet.clean[:, 0], exact[:, 0], rtol=1e-12)
    np.testing.assert_array_equal(quiet.clean[:, 1], usual.clean[:, 1])


@pytest.mark.parametrize("seed", range(4))
def test_a_clock_that_jumps(seed: int) -> None:
    log = simulate("calibration", seed=seed, noise=(0, 0, 0), outliers="clock=1:0.5").log
    step = np.diff(log.time_s[np.argsort(log.row)])
    assert sorted({round(float(s), 6) for s in step}) in ([-0.4, 0.1], [0.1, 0.6])
    assert log.rows_out_of_order == int((step < 0).any())
    assert (np.diff(log.time_s) >= 0).all()


def test_readings_of_another_time() -> None:
    usual = simulate("calibration", seed=1, noise=(0, 0, 0), outliers="none")
    late = simulate("calibration", seed=1, noise=(0, 0, 0), outliers="late=1:0.5")
    np.testing.assert_array_equal(late.log.time_s, usual.log.time_s)
    off = np.abs(late.log.measurement - usual.log.measurement).max(axis=1) > 0
    (side,) = runs(off)
    first = side.start
    assert 0.11 * len(off) < side.stop - side.start < 0.51 * len(off)
    assert side.start == 0 or side.stop == len(off)
    np.testing.assert_array_equal(late.truth.position_m, usual.truth.position_m)
    shift = round(
        abs(np.interp(late.log.measurement[first, 1], *by_azimuth(usual, first)) - usual.log.time_s[first]), 3
    )
    assert shift == 0.5


def by_azimuth(flight: Simulation, k: int) -> tuple[FloatArray, FloatArray]:
    """Azimuths, increasing, and times around a sample."""
    near = slice(max(k - 20, 0), k + 20)
    azimuth, time = np.unwrap(flight.log.measurement[near, 1]), flight.log.time_s[near]
    return (azimuth, time) if azimuth[-1] > azimuth[0] else (azimuth[::-1], time[::-1])


def test_readings_that_were_not_measured() -> None:
    held = simulate("manoeuvre", seed=5, outliers="all.held=0.6")
    again = codes(held)[:, 0] == contamination.CODES["held"]
    assert again.mean() == pytest.approx(0.6, abs=0.05)
    np.testing.assert_array_equal(np.diff(held.log.measurement, axis=0)[again[1:]], 0)
    lines = simulate("manoeuvre", seed=5, outliers="all.interpolated=4")
    between = codes(lines)[:, 0] == contamination.CODES["interpolated"]
    np.testing.assert_array_equal(np.flatnonzero(~between), np.arange(0, len(between), 4))
    bend = np.abs(np.diff(np.unwrap(lines.log.measurement[:, 1]), 2))
    assert bend[between[1:-1]].max() < 1e-12 < np.median(bend[~between[1:-1]])
    slower = simulate("manoeuvre", seed=5, outliers="range.interpolated=4.5")
    assert (codes(slower)[:, 0] != 0).mean() == pytest.approx(8 / 9, abs=0.01)
    assert not codes(slower)[:, 1].any()
    exact = simulate("manoeuvre", seed=5, noise=(0, 0, 0), outliers="range.interpolated=4.5")
    assert np.abs(deviation(exact)[:, 0]).max() < 1.0  # the path is bent; half a sample of flight is 5 m


def test_one_sided_errors() -> None:
    flight = simulate("manoeuvre", seed=5, outliers="range.onesided=0.5:10")
    off, code = deviation(flight)[:, 0] / flight.sigma[0], codes(flight)[:, 0]
    assert len(set(np.sign(off[code != 0]))) == 1
    assert (code != 0).mean() == pytest.approx(0.5, abs=0.05)
    assert np.abs(off[code != 0]).mean() == pytest.approx(10, rel=0.15)
    assert not off[code == 0].any()


@pytest.mark.parametrize("kind", ["offset", "ramp", "stuck", "burst"])
def test_patches_have_the_length_number_and_shape_said(kind: str) -> None:
    size = "" if kind == "stuck" else ":8-60"
    flight = simulate("manoeuvre", seed=6, outliers=f"{kind}=5:4-30{size}")
    flag, off = codes(flight), deviation(flight)
    for c, sigma in enumerate(flight.sigma):
        patches = runs(flag[:, c])
        assert len(patches) == 5
        for patch in patches:
            length = patch.stop - patch.start
            assert 4 <= length <= 30
            error = off[patch, c] / sigma
            if kind == "offset":
                np.testing.assert_allclose(error, error[0], rtol=1e-6)
                assert 8 <= abs(error[0]) <= 60
            elif kind == "ramp":
                np.testing.assert_allclose(error, error[-1] * np.arange(1, length + 1) / length, atol=1e-6)
                assert 8 <= abs(error[-1]) <= 60
            elif kind == "stuck":
                np.testing.assert_array_equal(flight.log.measurement[patch, c], flight.clean[patch.start - 1, c])
            else:
                assert np.abs(error).max() > 4


def test_start_zero_nan_and_rounding() -> None:
    flight = simulate("manoeuvre", seed=6, outliers="start=6:50,range.zero=0.1,nanrun=2:10,range.round=0.5m")
    reading, flag, off = flight.log.measurement, codes(flight), deviation(flight)
    assert (flag[:6] == 6).all()
    np.testing.assert_allclose(np.abs(off[:6, 1] / flight.sigma[1]), 50, rtol=1e-6)
    zero = (flag[:, 0] == 7) & ~np.isnan(reading[:, 0])
    assert zero.sum() > 100
    assert (reading[zero, 0] == 0).all()
    assert not (flag[:, 1:] == 7).any()
    lengths = [run.stop - run.start for run in runs(np.isnan(reading[:, 2]).astype(float))]
    assert sum(lengths) in range(10, 21)
    good = (flag[:, 0] == 0) & ~np.isnan(reading[:, 0])
    np.testing.assert_allclose(reading[good, 0] % 0.5, 0)


def test_absolute_sizes() -> None:
    flight = simulate("manoeuvre", seed=1, outliers="range.isolated=0.2:20-40m,azimuth.isolated=0.2:3mrad")
    off, hit = np.abs(deviation(flight)), codes(flight) == 1
    assert ((off[hit[:, 0], 0] >= 20) & (off[hit[:, 0], 0] <= 40)).all()
    np.testing.assert_allclose(off[hit[:, 1], 1], 3e-3, rtol=1e-6)
    assert not hit[:, 2].any()


def test_sizes_are_log_uniform_with_either_sign() -> None:
    reading, code = contaminate(
        np.zeros((40000, 3)), (Fault("isolated", rate=0.5, size=(10.0, 1000.0)),), np.ones(3), 1.0,
        np.random.default_rng(0),
    )  # fmt: skip
    size = reading[code == 1]
    assert np.mean(size > 0) == pytest.approx(0.5, abs=0.01)
    assert np.median(np.abs(size)) == pytest.approx(100.0, rel=0.03)
    assert np.mean(code[:, 0] == 1) == pytest.approx(0.5, abs=0.012)


def test_patches_keep_clear_of_each_other_and_what_does_not_fit_is_left_out() -> None:
    flight = simulate("zuo2021", seed=1, outliers="offset=30:5:10")
    for c in range(3):
        patches = runs(codes(flight)[:, c])
        assert 3 <= len(patches) < 30
        assert {patch.stop - patch.start for patch in patches} == {5}
        assert patches[0].start >= 1
    assert not codes(simulate("zuo2021", duration_s=3.0, outliers="offset=3:40:10")).any()


def test_isolated_outliers_leave_room_for_patches_whatever_the_order_of_the_items() -> None:
    for spec in ("isolated=0.5,offset=2:10:20", "offset=2:10:20,isolated=0.5"):
        flag = codes(simulate("manoeuvre", seed=2, outliers=spec))
        assert [(flag[:, c] == 2).sum() for c in range(3)] == [20, 20, 20]


def test_gap_removes_rows_from_log_and_truth() -> None:
    whole = simulate("manoeuvre", seed=9, outliers="isolated=0.05")
    flight = simulate("manoeuvre", seed=9, outliers="isolated=0.05,gap=1:5")
    step = np.diff(flight.log.time_s)
    assert (step > 0.06).sum() == 1
    assert step.max() == pytest.approx(5.0, abs=0.101)
    rows = np.searchsorted(whole.log.time_s, flight.log.time_s)
    np.testing.assert_array_equal(whole.log.measurement[rows], flight.log.measurement)
    np.testing.assert_array_equal(codes(whole)[rows], codes(flight))


def test_gap_that_does_not_fit_is_left_out() -> None:
    spec = OutlierSpec(gaps=((3, (100.0, 200.0)),))
    assert kept_rows(np.arange(61.0), spec, np.random.default_rng(0)).all()


def test_duplicates_are_copies_or_second_good_readings() -> None:
    flight = simulate("manoeuvre", seed=9, outliers="isolated=0.3:50-100,duplicates=400")
    log, flag = flight.log, codes(flight)
    second = np.flatnonzero(np.diff(log.time_s) == 0) + 1
    assert len(second) == log.duplicate_times == 400
    copy = (log.measurement[second] == log.measurement[second - 1]).all(axis=1)
    assert 150 < copy.sum() < 250
    np.testing.assert_array_equal(flag[second[copy]], flag[second[copy] - 1])
    assert not flag[second[~copy]].any()
    error = log.measurement[second[~copy]] - from_cartesian(flight.truth.position_m[second[~copy]])
    error[:, 1] = wrap(error[:, 1])
    assert (np.abs(error) < 5 * np.array(flight.sigma)).all()


def test_with_duplicates_never_asks_for_more_rows_than_there_are() -> None:
    rows, fresh = with_duplicates(4, 9, np.random.default_rng(0))
    np.testing.assert_array_equal(rows, [0, 0, 1, 1, 2, 2, 3, 3])
    assert not fresh[::2].any()


def test_jitter_keeps_order_and_ends() -> None:
    time = sample_times(1000.0, 1.0, 0.45, np.random.default_rng(0))
    assert (np.diff(time) > 0).all()
    off = time - np.arange(1001)
    assert np.abs(off).max() <= 0.45
    assert off.std() == pytest.approx(0.9 / 12**0.5, rel=0.1)
    assert time[0] >= 0
    assert time[-1] <= 1000
