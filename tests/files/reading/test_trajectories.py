"""Trajectories of other programs, and what is wrong with one. Round trips are in `writing/test_trajectories.py`."""

import numpy as np
import pytest

from ftproc.errors import InputError
from ftproc.files.reading import trajectories
from tests.files.conftest import Make


def test_a_bare_trajectory_of_another_program(make: Make) -> None:
    back = trajectories.read(make("time_s,x_m,y_m,z_m,speed\n2,1,2,3,9\n1,4,5,6,8\n"))
    assert back.time_s.tolist() == [1, 2]
    assert back.row.tolist() == [1, 0]
    assert back.state[:, :3].tolist() == [[4, 5, 6], [1, 2, 3]]
    assert np.isnan(back.state[:, 3:]).all()
    assert np.isnan(back.measurement).all()
    assert not back.outlier.any()
    assert back.extra is not None
    assert back.extra.to_pydict() == {"speed": [8, 9]}


@pytest.mark.parametrize("text", ["no json", "[1]", b"\xff"])
def test_a_json_file_of_another_program_is_no_metadata(make: Make, text: str | bytes) -> None:
    make(text, "log.json")
    assert trajectories.read(make("time_s,x_m,y_m,z_m\n2,1,2,3\n")).metadata == {}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("time_s,x_m,y_m\n0,1,2\n", 'there is no column "z_m"'),
        ("x_m,y_m,z_m\n0,1,2\n", 'there is no column "time_s"'),
        (
            "time_s,x_m,y_m,z_m\n0,1,2,3\n,1,2,3\n",
            'row 1 (the first data row is 0), column "time_s": the value is missing.',
        ),
        (
            "time_s,x_m,y_m,z_m,nis\n0,1,2,3,q\n",
            'column "nis": "q" is not a number; expected a number. Correct the cell.',
        ),
        ("time_s,x_m,y_m,z_m,outlier_range\n0,1,2,3,7\n", '"7" is not a flag; expected a whole number from 0 to 5.'),
    ],
)
def test_the_fault_of_a_trajectory_is_named(make: Make, text: str, expected: str) -> None:
    path = make(text)
    with pytest.raises(InputError) as caught:
        trajectories.read(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert expected in str(caught.value)
