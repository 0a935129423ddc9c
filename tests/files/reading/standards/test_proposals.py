"""Which columns are proposed where the names of many say nothing."""

from __future__ import annotations

import re

import numpy as np
import pytest

from ftproc.files.reading import logs
from tests.files.conftest import Make, refused
from tests.files.zoo.flight import flight

F = flight()
OTHERS = np.random.default_rng(3).normal(20, 3, (11, len(F.t)))


@pytest.mark.parametrize(
    "names", ["", ",".join(f"c{k}" for k in range(15)), "time," + ",".join(f"v{k}" for k in range(14))]
)
def test_readings_behind_many_other_columns_are_shown_and_proposed(make: Make, names: str) -> None:
    columns = [F.t, *OTHERS, F.r, np.degrees(F.a), np.degrees(F.e)]
    rows = "".join(",".join(f"{v:.5f}" for v in row) + "\n" for row in zip(*columns, strict=True))
    path = make(names + "\n" * bool(names) + rows)
    said = refused(path)
    assert "which change less smoothly" in said
    assert re.search(r"13(?: \"\w+\")?: \d{4}", said)
    say = re.search(r"--columns '?(\S*range=[^\s'.]*)", said)
    assert say is not None
    log = logs.read(path, columns=say[1].rstrip(","), units="azimuth=deg,elevation=deg,range=m")
    np.testing.assert_allclose(log.measurement[:, 0], F.r, rtol=1e-5)
    np.testing.assert_allclose(log.measurement[:, 2], F.e, atol=1e-5)
