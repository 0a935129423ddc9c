"""The next steps of a run that is not consistent, tried where that is cheap, and with the command to type."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from ftproc.errors import FtprocError
from ftproc.pipeline import Filtering
from ftproc.quality.next_steps import Step
from ftproc.quality.verdict import LEVELS, level_of

MOST_ROWS, MOST_TRIALS = 5_000, 3  # of a log that is filtered again, and how often
Command = Callable[[Mapping[str, Any]], str]


def steps(filtering: Filtering, summary: Mapping[str, Any], command: Command) -> list[dict[str, Any]]:
    """The next steps, those first that make the verdict better; those that make it worse are left out. command: the
    command line with some options changed."""
    level, left = LEVELS.index(level_of(summary["trust"])), MOST_TRIALS
    better: list[tuple[int, dict[str, Any]]] = []
    same: list[dict[str, Any]] = []
    rest: list[dict[str, Any]] = []
    for step in filtering.next_steps:
        typed = step.typed.replace("LOG ", f"{shlex.quote(filtering.log.name)} ", 1)
        found = {**step.as_dict(), "command": typed or command(step.options)}
        if (step.settings is None and step.model) or not left or len(filtering.log) > MOST_ROWS:
            rest.append(found)
            continue
        left -= 1
        outcome = _tried(filtering, step)
        if outcome is not None and outcome < level:
            better.append((outcome, {**found, "outcome": LEVELS[outcome]}))
        elif outcome == level:
            same.append(found)
        if outcome == 0:
            left = 0
    return [*(found for _, found in sorted(better, key=lambda each: each[0])), *same, *rest]


def _tried(filtering: Filtering, step: Step) -> int | None:
    """The verdict with a step, as its index in LEVELS; None if it cannot be had."""
    settings = filtering.settings if step.settings is None else step.settings
    try:
        other = Filtering(filtering.log, replace(settings), filtering.model if step.model else None, filtering)
        for _ in other.parts():
            pass
        return LEVELS.index(level_of(other.metadata["summary"]["trust"]))
    except FtprocError:
        return None
