"""A directory of foreign code beside the logs: a module of every name that a run imports, or tries to."""

from __future__ import annotations

import importlib.metadata
import os
import subprocess
import sys
from pathlib import Path

from ftproc.core import compiled
from ftproc.files.writing import flights
from ftproc.simulation import simulate

PROGRAM = str(Path(sys.prefix) / "bin" / "ftproc")

#: Python reads this when it starts, from a directory of PYTHONPATH, also in workers: it writes down the name of every
#: module that is looked for, and the file of every library that is loaded.
_WATCHER = """
import os, sys
place = os.environ["WATCHED"]
def note(kind, text):
    with open(os.path.join(place, f"{kind}.{os.getpid()}"), "a") as stream:
        stream.write(text + chr(10))
class Watcher:
    @staticmethod
    def find_spec(name, path=None, target=None):
        note("name", name.partition(".")[0])
def heard(event, given):
    if event == "import" and given[1]:
        note("library", given[1])
sys.meta_path.insert(0, Watcher)
sys.addaudithook(heard)
"""


class Watched:
    """Runs of the program in a directory, of which it is known what they looked for."""

    def __init__(self, folder: Path) -> None:
        self._path, self._notes = folder / "path", folder / "notes"
        self._path.mkdir()
        self._notes.mkdir()
        (self._path / "sitecustomize.py").write_text(_WATCHER)

    def run(self, place: Path, *command: str, **more: str) -> subprocess.CompletedProcess[str]:
        watched = {"PYTHONPATH": str(self._path), "WATCHED": str(self._notes), **more}
        return run(place, *command, **watched)

    def seen(self, kind: str) -> set[str]:
        """kind: name, library."""
        return {line for path in self._notes.glob(f"{kind}.*") for line in path.read_text().splitlines()}


def run(place: Path, *command: str, **more: str) -> subprocess.CompletedProcess[str]:
    environment = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}
    return subprocess.run(
        command, check=False, cwd=place, capture_output=True, text=True, timeout=600, env={**environment, **more}
    )


def fill(place: Path) -> None:
    """Two short logs with their truths."""
    for seed, name in enumerate("ab"):
        flight = simulate("zuo2021-outliers", seed=seed, duration_s=20.0)
        flights.write_log(flight.log, place / f"{name}.csv")
        flights.write_truth(flight.truth, place / f"{name}.truth.csv")


def plant(place: Path, looked_for: set[str]) -> Path:
    """A module of every name: those looked for, those of Python, and those of all that is installed. Also libraries of
    kernels, under the names of ours. The file into which they write when they are run."""
    ran = place / "RAN"
    names = looked_for | set(sys.stdlib_module_names) | set(importlib.metadata.packages_distributions())
    names |= {"ftproc", "sitecustomize", "usercustomize", compiled.GENERIC, compiled.MODERN}
    for name in filter(str.isidentifier, names):
        (place / f"{name}.py").write_text(
            f"with open({str(ran)!r}, 'a') as stream:\n    stream.write({name!r} + ' ')\n"
        )
    ours = [path for path in compiled.ROOM.glob("_kernels_*") if compiled.GENERIC in path.name]
    for folder in (place, place / "ftproc" / "core", place / "core"):
        folder.mkdir(parents=True, exist_ok=True)
        for path in ours:
            (folder / path.name).write_bytes(path.read_bytes())
    return ran
