"""Numbers that netCDF and HDF5 files pack by the CF conventions: as whole ones, with a factor and an offset."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ftproc.files.reading import logs

N = 60
RANGE_M, ANGLE_DEG = 5000.0 + 3.5 * np.arange(N), 30 + 0.25 * np.arange(N)
#: What is written, its type and attributes.
PACKED = {
    "time_s": (np.arange(N), "f8", {}),
    "range_m": (np.round((RANGE_M - 4000) / 0.5), "i4", {"scale_factor": 0.5, "add_offset": 4000.0, "_FillValue": -1}),
    "azimuth_deg": (np.round(ANGLE_DEG / 0.25), "i2", {"scale_factor": 0.25}),
    "elevation_deg": (np.full(N, 12.0), "f8", {"missing_value": -9999.0}),
}


def _netcdf(path: Path) -> None:
    from scipy.io import netcdf_file

    with netcdf_file(path, "w") as file:
        file.createDimension("time", N)
        for name, (values, kind, attributes) in PACKED.items():
            variable = file.createVariable(name, kind, ("time",))
            variable[:] = _with_gaps(name, values)
            for key, value in attributes.items():
                setattr(variable, key, value)


def _hdf5(path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        for name, (values, kind, attributes) in PACKED.items():
            file[name] = _with_gaps(name, values).astype(kind)
            file[name].attrs.update(attributes)


def _with_gaps(name: str, values: np.ndarray) -> np.ndarray:
    """The 6th range and the 8th elevation are missing."""
    gap = {"range_m": (5, -1), "elevation_deg": (7, -9999.0)}.get(name)
    values = values.astype(float)
    if gap is not None:
        values[gap[0]] = gap[1]
    return values


@pytest.mark.parametrize(("write", "ending"), [(_netcdf, "nc"), (_hdf5, "h5")])
def test_factors_offsets_and_numbers_for_none_are_heard(tmp_path: Path, write, ending: str) -> None:
    path = tmp_path / f"a.{ending}"
    write(path)
    log = logs.read(path)
    expected = np.stack([RANGE_M, np.radians(ANGLE_DEG), np.full(N, np.radians(12.0))], 1)
    expected[5, 0] = expected[7, 2] = np.nan
    np.testing.assert_allclose(log.measurement, expected, rtol=1e-12)
