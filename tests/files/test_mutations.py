"""Of good logs made ambiguous or wrong, none is read wrong without a condition, and no question misleads."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.files.mutations import Kind, judged, kinds

KNOWABLE = [kind for kind in kinds() if not kind.unknowable]


@pytest.mark.parametrize("kind", KNOWABLE, ids=lambda kind: kind.name)
def test_nothing_is_guessed(kind: Kind, tmp_path: Path) -> None:
    found = judged(kind, "overhead", tmp_path / "a.csv", verdicts=False)
    assert found != "wrong"
    assert not found.startswith("led")
    assert not (kind.told and found.startswith("asked"))
