"""What the experiments share: where the page and its plots go, and Markdown tables."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Page:
    """The directory that `reproduce.md` and its plots go to."""

    directory: Path

    def plot(self, name: str, caption: str, draw: Callable[[Any], None], panels: int = 1) -> str:
        """Save NAME.png, drawn by `draw` on its axes (a list of them for several panels); the Markdown to show it."""
        from matplotlib.figure import Figure  # without pyplot: nothing to close, no display needed

        figure = Figure(figsize=(8, 1 + 2.6 * panels), layout="constrained")
        axes = figure.subplots(panels, 1, sharex=True)
        draw(axes)
        for axis in figure.axes:
            axis.grid(alpha=0.3)
            axis.legend(fontsize="small")
        figure.savefig(self.directory / f"{name}.png", dpi=110, metadata={"Software": None})
        return f"![{caption}]({name}.png)\n\n*{caption}*\n"


def table(header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A Markdown table."""
    lines = ["| " + " | ".join(header) + " |", "|" + " --- |" * len(header)]
    lines += ["| " + " | ".join(_cell(value) for value in row) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def conclusions(found: Iterable[tuple[str, str, bool]]) -> str:
    """A table of what a paper concludes, what came out here, and whether the one follows from the other."""
    return table(("the paper says", "here", "it"), found)


def _cell(value: object) -> str:
    if isinstance(value, bool):
        return "holds" if value else "**does not hold**"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
