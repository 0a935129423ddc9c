"""Figures of merit of a trajectory: its smoothness, and against a truth its errors, consistency and outliers found.

from ftproc.scoring import render, score
print(render([score(trajectory, truth)], "table"))

Calls `core.model`, for angles and frames, and `files` for the text of a CSV; reads and writes no file.
"""

from ftproc.scoring.differences import Difference, compare
from ftproc.scoring.figures import Detection, Gradient, Score, score
from ftproc.scoring.rendering import FORMATS, render

__all__ = ["FORMATS", "Detection", "Difference", "Gradient", "Score", "compare", "render", "score"]
