"""The style of the report: colours, symbols, labels and units.

The colours are Okabe and Ito's, distinct for every colour vision; kinds of readings also differ in symbol.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ftproc.errors import UsageError
from ftproc.quality.verdict import CONSISTENT, SUSPECT, UNRELIABLE
from ftproc.records import ACCEPTED, ISOLATED, MISSING, PATCH, REJECTED

BLUE, ORANGE, GREEN, SKY = "#0072B2", "#E69F00", "#009E73", "#56B4E9"
VERMILLION, PURPLE, GREY, BLACK = "#D55E00", "#AA4499", "#8C8C8C", "#222222"
GRID, AXIS = "#E6E6E6", "#9A9A9A"

READING, ESTIMATE, LIMIT = GREY, BLUE, BLACK
AXES = (BLUE, ORANGE, GREEN)  # x, y, z
BAND = "rgba(0, 114, 178, 0.15)"

VERDICT = {CONSISTENT: GREEN, SUSPECT: ORANGE, UNRELIABLE: VERMILLION}


class Kind(NamedTuple):
    """How one kind of flagged reading is drawn."""

    name: str
    marker: dict[str, Any]


KINDS = {
    ISOLATED: Kind("isolated outlier", {"color": VERMILLION, "symbol": "x-thin-open", "size": 7, "line": {"width": 2}}),
    PATCH: Kind("patch outlier", {"color": PURPLE, "symbol": "diamond-open", "size": 7, "line": {"width": 1.5}}),
    REJECTED: Kind("rejected by hand", {"color": ORANGE, "symbol": "cross-open", "size": 8, "line": {"width": 1.5}}),
    ACCEPTED: Kind("accepted by hand", {"color": GREEN, "symbol": "circle-open", "size": 8, "line": {"width": 1.5}}),
    MISSING: Kind("missing (at the foot)", {"color": BLACK, "symbol": "line-ns-open", "size": 7, "line": {"width": 1}}),
}


class Quantity(NamedTuple):
    """factor: from SI to the unit shown."""

    label: str
    unit: str
    factor: float = 1.0

    @property
    def title(self) -> str:
        return f"{self.label}, {self.unit}"


DEGREE = 180 / np.pi
#: Of what is measured: as it is drawn.
QUANTITY = {
    "range": Quantity("R", "m"), "azimuth": Quantity("A", "deg", DEGREE), "elevation": Quantity("E", "deg", DEGREE),
    "range_rate": Quantity("Ṙ", "m/s"), "height": Quantity("h", "m"),
}  # fmt: skip
#: Small differences of these; factor: from their unit.
SIZE = {
    "range": Quantity("R", "m"), "azimuth": Quantity("A", "mrad", 1e3 / DEGREE),
    "elevation": Quantity("E", "mrad", 1e3 / DEGREE), "range_rate": Quantity("Ṙ", "m/s"), "height": Quantity("h", "m"),
}  # fmt: skip
RESIDUAL_UNIT = (Quantity("R", "m"), Quantity("A", "mrad", 1e3), Quantity("E", "mrad", 1e3))
POSITION = tuple(Quantity(axis, "m") for axis in "xyz")
VELOCITY = tuple(Quantity(f"v{axis}", "m/s") for axis in "xyz")
ACCELERATION = tuple(Quantity(f"a{axis}", "m/s²") for axis in "xyz")
TIME = "time, s"

_AXIS = {
    "gridcolor": GRID, "linecolor": AXIS, "zeroline": False, "ticks": "outside", "tickcolor": AXIS, "ticklen": 4,
    "exponentformat": "none", "separatethousands": True, "showline": True, "mirror": True,
    "title": {"standoff": 8},
}  # fmt: skip
LAYOUT: dict[str, Any] = {
    "template": "none",
    "paper_bgcolor": "white",
    "plot_bgcolor": "white",
    "font": {"family": "system-ui, 'Segoe UI', Helvetica, Arial, sans-serif", "size": 12, "color": BLACK},
    "margin": {"l": 88, "r": 44, "t": 36, "b": 46},
    "modebar": {"orientation": "v"},  # in the right margin, clear of the legend
    "legend": {
        "orientation": "h",
        "x": 0,
        "y": 1,
        "yref": "container",  # at the top of the figure: the plots give way to as many lines as there are
        "yanchor": "top",
        "itemsizing": "constant",
        "itemwidth": 40,  # px: room for a dash and a half
        "bgcolor": "rgba(0,0,0,0)",
    },
    "hovermode": "closest",
    "hoverlabel": {"bgcolor": "white", "font": {"color": BLACK}},
}


def axis(**changes: Any) -> dict[str, Any]:
    """An axis of a plane figure, with some changes."""
    return {**_AXIS, **changes}


def require_plotly() -> Any:
    """The module plotly.graph_objects. Raises UsageError when it is not installed."""
    try:
        import plotly.graph_objects
    except ImportError as error:
        raise UsageError('reports need plotly, which is not installed: pip install "plotly>=6.0".') from error
    return plotly.graph_objects
