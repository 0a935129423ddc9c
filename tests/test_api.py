"""The front of the package: what `import ftproc` shows, and the arguments of `filter_log`."""

from __future__ import annotations

import re
from dataclasses import fields
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import ftproc
from ftproc.errors import UsageError


def test_dir_shows_the_public_names_and_each_is_there():
    assert dir(ftproc) == sorted(ftproc.__all__)
    assert all(getattr(ftproc, name) is not None for name in ftproc.__all__)
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        _ = ftproc.nothing


@pytest.mark.parametrize("kind", [ftproc.FilterSettings, ftproc.TrainSettings, ftproc.Station])
def test_every_setting_is_explained(kind):
    unexplained = [each.name for each in fields(kind) if f"{each.name}" not in (kind.__doc__ or "")]
    assert not unexplained


def test_every_public_function_says_what_it_does():
    for name in ftproc.__all__:
        found = getattr(ftproc, name)
        assert isinstance(found, str) or len(found.__doc__) > 40, name


def frame():
    flight = ftproc.simulate("zuo2021", seed=2)
    log = flight.log
    return pd.DataFrame({"t": log.time_s, "R": log.measurement[:, 0], "A": log.measurement[:, 1],
                         "E": log.measurement[:, 2]}), flight  # fmt: skip


def test_filter_log_takes_the_azimuths_zero_and_the_site():
    table, flight = frame()
    plain = ftproc.filter_log(table)
    assert plain.metadata["frame"] == "local"
    north = ftproc.filter_log(table, azimuth_from="north", site=(48.0, 11.0, 600.0))
    assert north.metadata["frame"] == "north-east-up"
    np.testing.assert_allclose(north.state, plain.state)
    assert {"lat_deg", "lon_deg", "height_m"} <= set(north.to_pandas().columns)
    with pytest.raises(UsageError, match="was read already"):
        ftproc.filter_log(flight.log, azimuth_from="north")


def test_the_site_here_wins_over_the_settings():
    table, _ = frame()
    settings = ftproc.FilterSettings(site=(10.0, 10.0, 0.0), derived=True)
    found = ftproc.filter_log(table, settings, site=(48.0, 11.0, 600.0), azimuth_from="x").to_pandas()
    assert found.lat_deg.between(47, 49).all()
    assert "track_deg" in found


def test_the_newest_change_is_of_this_version():
    changes = Path(ftproc.__file__).with_name("CHANGES.md").read_text(encoding="utf-8")
    assert re.findall(r"^## (.*)$", changes, re.MULTILINE)[0] == ftproc.__version__
