"""Real files in a temporary directory, from text or bytes; and what is said of a bad log."""

from collections.abc import Callable
from pathlib import Path

import pytest

from ftproc.errors import InputError
from ftproc.files.reading import logs

Make = Callable[..., Path]


@pytest.fixture
def make(tmp_path: Path) -> Make:
    """make(content, name="log.csv") writes the content as it stands and returns the path."""

    def write(content: str | bytes, name: str = "log.csv") -> Path:
        path = tmp_path / name
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        return path

    return write


def refused(path: object, **options: object) -> str:
    """The message of the refused log, which names it and has one line."""
    with pytest.raises(InputError) as caught:
        logs.read(path, **options)  # type: ignore[arg-type]
    sentence = str(caught.value)
    assert sentence.startswith(f"{path}: " if isinstance(path, str | Path) else "<table>: ")
    assert "\n" not in sentence
    return sentence
