"""Measurement files of LabVIEW."""

import numpy as np
import pytest

from ftproc.files.reading import logs
from tests.files.conftest import Make, refused
from tests.files.zoo.flight import flight

FLIGHT = flight()
CELLS = np.column_stack([FLIGHT.r / 1e3, np.degrees(FLIGHT.a), np.degrees(FLIGHT.e)])
HEAD = (
    "LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\t{mark}\nDecimal_Separator\t{point}\nTime_Pref\t{time}\n"
    "Date\t2024/05/31\nTime\t10:12:13.5\n***End_of_Header***\t\n\t\n"
)
SEGMENT = (
    "Channels\t3\t\t\t\nSamples\t{n}\t{n}\t{n}\t\nDate\t2024/05/31\t2024/05/31\t2024/05/31\t\n"
    "Time\t10:12:{start}\t10:12:{start}\t10:12:{start}\t\nY_Unit_Label\tkm\tdeg\tdeg\t\nX_Dimension\tTime\tTime\tTime\n"
    "X0\t{x0}\t{x0}\t{x0}\nDelta_X\t{step}\t{step}\t{step}\n***End_of_Header***\nX_Value\tRange\tAzimuth\tElev\tComment\n"
)
STEP = float(FLIGHT.t[1])
KINDS = {
    "one segment": {"parts": 1},
    "X goes on": {"parts": 3},
    "X restarts": {"parts": 3, "restarts": True},
    "no X": {"parts": 1, "x": False},
    "decimal commas": {"parts": 2, "point": ","},
    "commas between": {"parts": 2, "mark": "Comma"},
    "since 1904": {"parts": 1, "time": "Absolute"},
}


def measured(
    parts: int, restarts: bool = False, x: bool = True, point: str = ".", mark: str = "Tab", time: str = "Relative"
) -> str:
    text = HEAD.format(mark=mark, point=point, time=time)
    for rows in np.array_split(np.arange(len(FLIGHT.t)), parts):
        first = FLIGHT.t[rows[0]]
        start, x0 = f"{13.5 + first:09.6f}", f"{0 if restarts else FLIGHT.t[rows[0]]:.6E}"
        text += SEGMENT.format(n=len(rows), start=start, x0=x0, step=f"{STEP:.6f}")
        since = 3_800_000_000.0 if time == "Absolute" else -first * restarts
        for row in rows:
            cells = [f"{FLIGHT.t[row] + since:.6f}" if x else "", *(f"{cell:.7f}" for cell in CELLS[row])]
            text += "\t".join(cells).replace(".", point) + ("\tlocked\n" if row == 2 else "\n")
        text += "\n"
    return text.replace("\t", ",") if mark == "Comma" else text


@pytest.mark.parametrize("kind", KINDS)
def test_a_measurement_is_read_with_its_units(make: Make, kind: str) -> None:
    log = logs.read(make(measured(**KINDS[kind]), "log.lvm"))  # type: ignore[arg-type]
    np.testing.assert_allclose(log.time_s - log.time_s[0], FLIGHT.t, atol=2e-6)
    np.testing.assert_allclose(log.measurement[:, 0], FLIGHT.r, atol=1e-3)
    np.testing.assert_allclose(log.measurement[:, 2], FLIGHT.e, atol=1e-8)
    assert log.understood["file"] == "LabVIEW measurement"
    assert log.time_s[0] == pytest.approx(36733.5 if kind != "since 1904" else 3_800_000_000 - 2082844800)


def test_channels_with_times_of_their_own_are_refused(make: Make) -> None:
    rows = "".join(f"{k},{9000 + k},{k + 0.5},30\n" for k in range(9)).replace(",", "\t")
    head = HEAD.format(mark="Tab", point=".", time="Relative") + "Channels\t2\n***End_of_Header***\n"
    said = refused(make(f"{head}X_Value\tRange (m)\tX_Value\tAz (deg)\tComment\n{rows}", "log.lvm"))
    assert said.endswith("its channels have X values of their own; write it with one X column.")
