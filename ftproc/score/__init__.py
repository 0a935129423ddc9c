"""How good a trajectory is: by itself (smoothness) and against a truth (errors, consistency, outliers found).

from ftproc.score import render, score
print(render([score(trajectory, truth)], "table"))
"""

from ftproc.score.figures import Detection, Gradient, Score, score
from ftproc.score.rendering import FORMATS, render

__all__ = ["FORMATS", "Detection", "Gradient", "Score", "render", "score"]
