"""Runs commands as a reader of the pages types them."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
KEPT = ROOT / "out" / "readme"  # the output of commands that take long

#: The program and the interpreter are those that run this, whatever is installed.
_NAMES = f'ftproc() {{ "{sys.executable}" -P -m ftproc "$@"; }}; python() {{ "{sys.executable}" "$@"; }}; '


class Shell:
    """Runs each command once, in a folder where its files may lie.

    kept: take the output of commands that take long from where an earlier run kept it.
    """

    def __init__(self, folder: Path, kept: bool = False) -> None:
        self.folder, self.kept = folder, kept
        self._outputs: dict[str, str] = {}

    def output(self, command: str) -> str:
        """What the command prints. Raises RuntimeError, with what it says, when it fails."""
        if command not in self._outputs:
            self._outputs[command] = _run(command, self.folder)
        return self._outputs[command]

    def slow_output(self, command: str, name: str) -> str:
        """The same for a command that takes long: it runs in the project, its output is kept in KEPT/NAME.txt."""
        file = KEPT / f"{name}.txt"
        if not self.kept:
            if command not in self._outputs:
                self._outputs[command] = _run(command, ROOT)
            KEPT.mkdir(parents=True, exist_ok=True)
            file.write_text(self._outputs[command], encoding="utf-8")
        return file.read_text(encoding="utf-8")


def _run(command: str, folder: Path) -> str:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        ["bash", "-o", "pipefail", "-c", _NAMES + command],
        cwd=folder, env=environment, capture_output=True, text=True,
    )  # fmt: skip
    if done.returncode:
        raise RuntimeError(f"{command}\nended with {done.returncode}:\n{done.stderr}{done.stdout}")
    return done.stdout
