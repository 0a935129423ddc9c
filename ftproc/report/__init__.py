"""The report: one page, HTML or PDF, with the verdict, the summary and the figures of a trajectory.

    from ftproc import report
    report.write(trajectory, "flight.html")     # one self-contained page; flight.pdf: printed on A4
    report.plot(trajectory, "residuals")        # one of its figures

plotly draws the figures; it is an extra (`report`), loaded when first used. Calls `quality`, `scoring` and `files`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ftproc.errors import UsageError
from ftproc.report.style import require_plotly

if TYPE_CHECKING:
    import plotly.graph_objects as go

    from ftproc.files.layout import Target
    from ftproc.records import Trajectory, Truth


def write(trajectory: Trajectory, target: Target, truth: Truth | None = None) -> None:
    """Write the page of a trajectory, whole or not at all; with a truth also its errors. A name in .pdf: printed.

    A trajectory read from a file has no raw readings. The same trajectory gives the same bytes of HTML. Raises
    OutputError; UsageError when plotly, or a browser for a PDF, is not installed.
    """
    check(target)
    from ftproc.report.browser import printing
    from ftproc.report.page import page

    printing.write(page(trajectory, truth), target)


def check(target: Target) -> None:
    """Raise UsageError, before any work is done, when what the report needs is not installed: plotly, and for a PDF a
    browser."""
    from ftproc.report.browser import printing

    require_plotly()
    if printing.is_pdf(target):
        printing.require_browser(target)


def plot(trajectory: Trajectory, what: str = "track") -> go.Figure:
    """One figure of the page by its name. Raises UsageError for an unknown name, when plotly is not installed, or when
    the trajectory has no data for it."""
    require_plotly()
    from ftproc.report.page import FIGURES
    from ftproc.report.view import view

    if what not in FIGURES:
        raise UsageError(f"there is no figure {what!r}; there are {', '.join(FIGURES)}")
    drawn = FIGURES[what](view(trajectory))
    if drawn.figure is None:
        raise UsageError(f"{trajectory.name}: {drawn.note}")
    return drawn.figure
