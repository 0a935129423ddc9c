"""The lists of versions belong to pyproject.toml: what is tested as oldest is what it allows as oldest."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

from tests.fuzz import targets
from tests.trust import audit

ROOT = Path(__file__).parents[2]
OF_THE_USER = ("cluster", "geo", "formats", "report", "wavelet", "hdf5")


def listed(name: str) -> dict[str, str]:
    lines = (ROOT / "tests" / name).read_text().splitlines()
    return dict(line.split("==") for line in lines if "==" in line)


def bounds() -> dict[str, str]:
    """What a user's installation may need, and from which version on; numba compiles the kernels."""
    said = tomllib.loads((ROOT / "pyproject.toml").read_text())
    project = said["project"]
    extras = [need for extra in OF_THE_USER for need in project["optional-dependencies"][extra]]
    compiler = [need for need in said["build-system"]["requires"] if need.startswith("numba")]
    return dict(need.split(">=") for need in [*project["dependencies"], *extras, *compiler])


def test_the_oldest_versions_are_those_of_pyproject() -> None:
    oldest = listed("requirements-oldest.txt")
    assert set(oldest) == set(bounds())
    for name, bound in bounds().items():
        assert f"{oldest[name]}.".startswith(f"{bound}."), name


def test_the_tested_versions_name_every_dependency() -> None:
    assert set(bounds()) <= set(listed("requirements-tested.txt"))


def test_make_fuzz_knows_every_target() -> None:
    (line,) = [line for line in (ROOT / "Makefile").read_text().splitlines() if line.startswith("FUZZ = ")]
    assert sorted(line.removeprefix("FUZZ = ").split()) == sorted(targets.all_targets())


def answer(*packages: dict[str, Any]) -> str:
    return json.dumps({"dependencies": packages, "fixes": []})


def test_an_audit_counts_only_when_it_was_one() -> None:
    good: dict[str, Any] = {"name": "numpy", "version": "2.4.6", "vulns": []}
    bad = {"name": "pillow", "version": "9.0", "vulns": [{"id": "CVE-1", "fix_versions": ["9.1"]}]}
    unknown = {"name": "ruff", "skip_reason": "Dependency not found on PyPI and could not be audited"}
    assert audit.verdict(answer(good)) == (["1 of 1 packages audited, 0 vulnerabilities known."], 0)
    lines, code = audit.verdict(answer(good, bad))
    assert (lines[0], code) == ("pillow 9.0: CVE-1, mended in 9.1", 1)
    lines, code = audit.verdict(answer(good, unknown))
    assert lines[0].startswith("1 of 2 packages audited, 0")
    assert "NOT audited" in lines[1]
    assert lines[1].endswith("answer: ruff.")
    assert code == 0
    assert audit.verdict("", "a\nno network\n") == (["NOT audited: pip-audit had no answer (no network)."], 0)
