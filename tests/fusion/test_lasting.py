"""The search for faults that last of one station among several: what it may cost."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from ftproc.core import work
from ftproc.core.editing.lasting import proposals, search, weighing
from ftproc.core.model import frames
from ftproc.files.writing import ranges
from ftproc.fusion import flight, range_file
from ftproc.settings import FilterSettings
from ftproc.simulation import simulate_range


def fused(folder):
    return flight.fuse(range_file.load(str(folder / "range.toml")), FilterSettings(smooth=True)).trajectory


def test_where_no_work_is_left_the_verdict_says_so_as_for_one_station(folder, monkeypatch):
    monkeypatch.setattr(work, "LASTING", 0)
    monkeypatch.setattr(work, "LASTING_PER_SAMPLE", 0)
    trust = fused(folder).metadata["summary"]["trust"]
    assert "the search for likelier outlier decisions was cut short: 1 place was not examined" in trust["reasons"]
    assert trust["verdict"] != "consistent"


def test_one_budget_is_shared_by_the_stations():
    one, two, three = (work.for_lasting_faults(1000, stations).left for stations in (1, 2, 3))
    assert one < two == three


@pytest.mark.parametrize(("width", "n"), [(3, 1000), (30, 1000), (30, 20_000), (200, 20_000), (1000, 200_000)])
def test_a_scan_beside_a_jump_has_no_wider_cells_in_a_longer_flight(width, n):
    """Where an end is looked for, it has a cell for each sample of them."""
    cell = proposals.cell_of(width, n)
    assert cell <= 2 * proposals.FARTHEST // proposals.CELLS
    assert cell * proposals.CELLS >= min(n, 2 * proposals.FARTHEST) - proposals.CELLS
    assert cell == width or width > 50 or n > width * proposals.CELLS


def test_a_jump_that_is_none_asks_for_no_process_noise_of_its_own(tmp_path, monkeypatch):
    ranges.write(simulate_range("range-theodolites", 1, 40.0), str(tmp_path / "range"), None)
    fit_jerk, jump, fits, jumps = weighing.fit_jerk, search._at, list[object](), list[object]()
    monkeypatch.setattr(weighing, "fit_jerk", lambda *of: fits.append(0) or fit_jerk(*of))
    monkeypatch.setattr(search, "_at", lambda *of: jumps.append(0) or jump(*of))
    fused(tmp_path / "range")
    assert jumps
    assert not fits
    monkeypatch.setattr(search, "_left_as_steps", lambda seen, jump: jump)
    fused(tmp_path / "range")
    assert len(fits) > 5 * len(jumps)


def two_radars(folder, off):
    """Truth (n, 4) time s and position m of an airliner that two radars have seen for six minutes; off: by what the
    readings of the first are larger, m, rad, rad."""
    rng, t, text = np.random.default_rng(0), np.arange(0, 361, 1.0), ""
    position = np.stack([-30_000 + 200 * t, 20_000 - 8000 * np.sin(t / 200), 8000 + 500 * np.sin(t / 150)], 1)
    for k, place in enumerate(([0.0, 0.0, 0.0], [30_000.0, -12_000.0, 0.0])):
        at = np.arange(0.3 * k, 360, 4.0)
        seen = np.stack([np.interp(at, t, axis) for axis in position.T], 1) - place
        z = (
            frames.from_cartesian(seen)
            + rng.standard_normal(seen.shape) * [25.0, 8e-4, 8e-4]
            + np.array(off) * (k == 0)
        )
        log = pd.DataFrame(z, columns=["range_m", "azimuth_rad", "elevation_rad"]).assign(time_s=at)
        log.to_csv(folder / f"r{k}.csv", index=False)
        text += f'[station.r{k}]\nlog = "r{k}.csv"\neast_m = {place[0]}\nnorth_m = {place[1]}\nup_m = 0\n'
    (folder / "range.toml").write_text(text)
    return np.column_stack([t, position])


def test_an_offset_that_the_range_file_does_not_state_is_a_bias(tmp_path):
    """It was called a step after the first reading, and the track hung on that."""
    truth = two_radars(tmp_path, (0.0, -5e-3, 0.0))
    track = fused(tmp_path)
    trust = track.metadata["summary"]["trust"]
    assert trust["verdict"] == "suspect"
    said = " ".join(trust["reasons"])
    assert "r0 and r1: the azimuth readings are off by" in said
    assert "State azimuth_bias_sigma_mrad" in said
    assert "steps by" not in said
    at = np.stack([np.interp(track.time_s, truth[:, 0], axis) for axis in truth[:, 1:].T], 1)
    assert (np.abs(track.state[:, :3] - at) <= 4 * track.sigma[:, :3]).all(1).mean() > 0.97


def test_where_the_range_file_is_right_no_bias_is_taken_as_unknown(tmp_path):
    two_radars(tmp_path, (0.0, 0.0, 0.0))
    trust = fused(tmp_path).metadata["summary"]["trust"]
    assert trust["verdict"] == "consistent"
