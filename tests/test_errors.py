"""What errors say."""

from ftproc.errors import nearest


def test_nearest_ignores_case_and_is_empty_for_nothing_similar() -> None:
    assert nearest("rng", ["TIME", "RNG_1"]) == '; did you mean "RNG_1"?'
    assert nearest("range", ["x", "y"]) == ""
