"""Training of a correction: samples, genetic search, back-propagation, and the verdict of held-out flights.

Calls `correction`; `flights` also calls `methods`, `quality` and `scoring`.
"""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[str, int, int], None]  # stage, steps done, steps in all (it may end before)
Steps = Callable[[int, int], None]  # the same of one stage


def silent(*_: object) -> None:
    """The progress that nobody reads."""
