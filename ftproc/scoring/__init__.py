"""How good a trajectory is: by itself (smoothness) and against a truth (errors, consistency, outliers found).

from ftproc.scoring import render, score
print(render([score(trajectory, truth)], "table"))
"""

from ftproc.scoring.figures import Detection, Gradient, Score, score
from ftproc.scoring.rendering import FORMATS, render

__all__ = ["FORMATS", "Detection", "Gradient", "Score", "render", "score"]
