"""A truth on the earth, in the frame of a trajectory."""

import numpy as np
import pytest

from ftproc.core.model.earth import place_at
from ftproc.errors import InputError
from ftproc.files.reading import truth

SITE = (48.0, 11.0, 500.0)


@pytest.fixture
def file(tmp_path):
    points = np.array([[1000.0, 2000.0, 300.0], [1100.0, 2000.0, 310.0], [np.nan, 0.0, 0.0]])
    rows = [f"{k},{','.join(repr(v) for v in place_at(SITE, p))}" for k, p in enumerate(points[:2])]
    path = tmp_path / "gnss.csv"
    path.write_text("time_s,lat_deg,lon_deg,height_m\n" + "\n".join(rows) + "\n2,,,\n")
    return path, points[:2]


@pytest.mark.parametrize("north", [False, True])
def test_it_is_in_the_frame(file, north):
    path, points = file
    found = truth.read(path, truth.Frame(SITE, north))
    np.testing.assert_allclose(found.position_m, points[:, [1, 0, 2]] if north else points, atol=1e-3)
    assert found.time_s.tolist() == [0, 1]


def test_without_a_site_the_cure_is_said(file):
    with pytest.raises(InputError, match="no site is known; say --site"):
        truth.read(file[0])
