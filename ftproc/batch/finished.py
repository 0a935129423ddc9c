"""Which logs of a batch an earlier run has finished: their outputs say of which log, recipe and version they are.

A table and its metadata are replaced so that what a kill leaves never passes for finished: see
`files.writing.trajectories.write`.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
from dataclasses import asdict, replace
from typing import Any

import ftproc
from ftproc.config.recipe import Origin, Recipe
from ftproc.files import remote
from ftproc.files.reading.formats import content
from ftproc.settings import NO_MODEL


def metadata(output: str, log: str, recipe: Recipe) -> dict[str, Any] | None:
    """The metadata of a trajectory on this machine if this version has made it of the same log with the same recipe."""
    from ftproc.files.reading import trajectories

    path, digest = remote.local(output), _sha256(log)
    if not digest or path is None or not path.is_file():
        return None
    found = trajectories.metadata(output)
    wanted = {"log_sha256": digest, "recipe_sha256": recipe_sha256(recipe), "version": ftproc.__version__}
    return found if wanted.items() <= found.items() else None


def _sha256(log: str) -> str:
    """Of the file that a log is, or is a part of (behind #); "" if it is no ordinary file of this machine."""
    for name in (log, log.rpartition("#")[0]):
        path = remote.local(name) if name else None
        with contextlib.suppress(OSError, ValueError):
            if path is not None and path.is_file():
                return content.sha256(path)
    return ""


def recipe_sha256(recipe: Recipe) -> str:
    """Of what is done with a log: with the contents of the model and of the decisions by hand, whatever their files are
    called."""
    from ftproc.correction import model_file

    model = model_file.named(recipe.model)
    known = asdict(replace(recipe, model=NO_MODEL, decisions=None, origin=Origin()))
    known["model"] = None if model is None else model_file.sha256(model)
    known["decisions"] = None if recipe.decisions is None else recipe.decisions.sha256
    return hashlib.sha256(json.dumps(known, sort_keys=True, default=repr).encode()).hexdigest()
