"""The page of a fused flight: map with lines of sight, residuals and use of each station, biases before and after.

Stands on `report`, whose page and figures it uses, and on `fusion`, whose flight it shows.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ftproc.report import check
from ftproc.report import write as write_single
from ftproc.report.browser import printing

if TYPE_CHECKING:
    from ftproc.files.layout import Target
    from ftproc.fusion.flight import Flight


def write(flight: Flight, target: Target) -> None:
    """Write the page of a fused flight, whole or not at all; as `report.write` does."""
    check(target)
    if flight.fused is None:
        write_single(flight.trajectory, target)
        return
    from ftproc.report.fused.page import page

    printing.write(page(flight), target)
