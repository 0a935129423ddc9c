"""The page of a fused flight."""

from __future__ import annotations

import html

from ftproc.fusion import summary
from ftproc.fusion.flight import Flight
from ftproc.quality import summary as single
from ftproc.report import deciding, tables
from ftproc.report.fused.figures import biases, carried, disagreements, log_clocks, residuals, station_map
from ftproc.report.maps.track import track
from ftproc.report.page import document, section
from ftproc.report.timeplots import motion, sigmas
from ftproc.report.view import view


def page(flight: Flight) -> str:
    """The whole page as HTML text."""
    fused, shown = flight.fused, view(flight.trajectory)
    assert fused is not None
    s = flight.trajectory.metadata["summary"]
    stretches = disagreements(flight, fused)
    when = tables.when(shown).removeprefix("time, ")
    listed = (
        tables.table(("station", f"from, {when}", f"to, {when}", "what"), stretches, "numbers") if stretches else ""
    )
    nothing = "" if stretches else '<p class="note">No station joins late, is silent or follows another target.</p>'
    readings = tables.table(summary.COMPONENT_HEADER, summary.component_rows(s), "numbers stations")
    known = tables.table(summary.BIAS_HEADER, summary.bias_rows(s), "numbers stations")
    said = [*([f"motion: {single.motion(s)}"] if s.get("motion") else []), *s["notes"]]
    notes = "".join(f"<li>{html.escape(note)}</li>" for note in said)
    parts = [
        tables.heading(shown),
        tables.banner(shown),
        f"<section><h2>Stations</h2>{readings}<ul>{notes}</ul></section>",
        tables.extremes(shown),
        section("Map", [("map", station_map(flight, fused)), ("track", track(shown))]),
        section("Who carried which stretch", [("carried", carried(flight, fused))], listed + nothing),
        section("Biases and clocks", [("biases", biases(flight, fused))], known),
        section("Residuals", [("residuals", residuals(flight, fused))]),
        deciding.section(shown, flight.trajectory.name, log_clocks(flight, fused)),
        section("Uncertainty", [("sigmas", sigmas(shown))]),
        section("Motion", [("motion", motion(shown))]),
        tables.provenance(shown),
    ]
    return document(tables.name(flight.trajectory), "\n".join(parts), drawn=True)
