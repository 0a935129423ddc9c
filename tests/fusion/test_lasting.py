"""The search for faults that last of one station among several: what it may cost."""

from __future__ import annotations

import pytest

from ftproc.core import work
from ftproc.core.editing.lasting import proposals
from ftproc.fusion import flight, range_file
from ftproc.settings import FilterSettings


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
