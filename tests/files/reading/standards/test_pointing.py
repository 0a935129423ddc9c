"""Angles that point where others do: beyond a turn, below zero, over the zenith, in the second face, from the bow."""

import numpy as np

from ftproc.files.reading import logs
from tests.files.conftest import Make, refused
from tests.files.reading.standards.test_strangers import RANGES, ROWS, A, E, R, T, plain


def angles_apart(one: np.ndarray, other: np.ndarray) -> float:
    return float(np.abs(np.angle(np.exp(1j * (one - other)))).max())


def test_azimuths_without_a_unit_count_on_beyond_a_turn(make: Make) -> None:
    rows = (f"{t},{r:.3f},{(a if a < 200 else a - 360) + 360:.6f},{e:.6f}\n" for t, r, a, e in ROWS)
    log = logs.read(make("t,range,az,el\n" + "".join(rows)))
    assert angles_apart(log.measurement[:, 1], A) < 2e-6
    np.testing.assert_allclose(log.measurement[:, 2], E, atol=2e-6)


def test_the_second_face_of_a_theodolite(make: Make) -> None:
    rows = (
        f"{t},{r:.3f},{(a / 0.9 + 200 * (t > 30)) % 400:.6f},{(90 - e if t <= 30 else 270 + e) / 0.9:.6f}\n"
        for t, r, a, e in ROWS
    )
    log = logs.read(make("t_s,sd_m,Hz_gon,V_gon\n" + "".join(rows)))
    assert angles_apart(log.measurement[:, 1], A) < 2e-6
    np.testing.assert_allclose(log.measurement[:, 2], E, atol=2e-6)
    assert any("are of the second face" in remark for remark in log.remarks)


def test_a_single_elevation_beyond_a_turn_is_left_as_it_is(make: Make) -> None:
    wrong = E.copy()
    wrong[50] = 5.0
    log = logs.read(make(plain(el=wrong)))
    np.testing.assert_allclose(log.measurement[50], [R[50], A[50], 5.0], atol=1e-3)


def ship(head: str, bearing: np.ndarray, beside: np.ndarray) -> str:
    rows = zip(T.tolist(), beside.tolist(), bearing.tolist(), RANGES, strict=True)
    return "\n".join([head, *(f"{t},{b:.6f},{a:.6f},{r / 1852:.6f}" for t, b, a, r in rows)]) + "\n"


def test_bearings_from_the_bow_and_headings_without_a_unit_are_added(make: Make) -> None:
    heading = 40 + 25 * np.sin(T / 20)
    log = logs.read(make(ship("t_s,Own Heading,Rel Brg,Range NM", (np.degrees(A) - heading) % 360, heading)))
    assert angles_apart(log.measurement[:, 1], A) < 2e-6


def test_elevations_of_circles_below_zero(make: Make) -> None:
    low = E - 0.2
    log = logs.read(make(plain(el=low % (2 * np.pi))))
    np.testing.assert_allclose(log.measurement[:, 2], low, atol=2e-6)
    assert any("are below the horizontal" in remark for remark in log.remarks)


def test_a_mount_follows_over_the_zenith(make: Make) -> None:
    x, y, z = -600 + 10 * T, 20.0 + 0 * T, 100.0
    r = np.sqrt(x**2 + y**2 + z**2)
    azimuth, elevation = np.arctan2(x, y) % (2 * np.pi), np.arcsin(z / r)
    over = x > 0
    text = "t_s,range_m,az_deg,el_deg\n" + "".join(
        f"{t},{d:.3f},{a:.6f},{e:.6f}\n"
        for t, d, a, e in zip(
            T.tolist(), r.tolist(), np.degrees(np.where(over, azimuth + np.pi, azimuth)).tolist(),
            np.degrees(np.where(over, np.pi - elevation, elevation)).tolist(), strict=True,
        )
    )  # fmt: skip
    log = logs.read(make(text))
    assert angles_apart(log.measurement[:, 1], azimuth) < 2e-6
    np.testing.assert_allclose(log.measurement[:, 2], elevation, atol=2e-6)
    assert any("are beyond the zenith" in remark for remark in log.remarks)


def test_a_patch_of_elevations_beyond_the_zenith_turns_no_azimuths(make: Make) -> None:
    patch = E.copy()
    patch[20:30] = 1.8
    log = logs.read(make(plain(el=patch)))
    np.testing.assert_allclose(log.measurement[:, 2], patch, atol=2e-6)
    assert angles_apart(log.measurement[:, 1], A) < 2e-6


def test_elevations_of_a_plunged_telescope_are_no_zenith_angles(make: Make) -> None:
    said = refused(make(plain(el=np.pi - E, az=(A + np.pi) % (2 * np.pi))))
    assert "as in the second face of a telescope" in said
    assert "--elevation-from" not in said
