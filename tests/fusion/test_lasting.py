"""The search for faults that last of one station among several: what it may cost."""

from __future__ import annotations

import pytest

from ftproc.core import work
from ftproc.core.editing.lasting import proposals, search, weighing
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
