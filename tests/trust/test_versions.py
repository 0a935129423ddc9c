"""The lists of versions belong to pyproject.toml: what is tested as oldest is what it allows as oldest."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]


def listed(name: str) -> dict[str, str]:
    lines = (ROOT / "tests" / name).read_text().splitlines()
    return dict(line.split("==") for line in lines if "==" in line)


def test_the_oldest_versions_are_those_of_pyproject() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    bounds = dict(re.split(">=", need) for need in project["dependencies"])
    oldest = listed("requirements-oldest.txt")
    for name, bound in bounds.items():
        assert f"{oldest[name]}.".startswith(f"{bound}."), name


def test_the_tested_versions_name_every_dependency() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert {need.partition(">=")[0] for need in project["dependencies"]} <= set(listed("requirements-tested.txt"))
