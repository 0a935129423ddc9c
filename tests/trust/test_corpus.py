"""Every bad log, model and truth is refused in a plain sentence or read correctly; nothing hangs, nothing explodes."""

from __future__ import annotations

import itertools
import os
import resource
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from ftproc.errors import InputError, printable
from tests.trust import cases, corpus

MANY = 300
MOST_MEMORY_KB = 3 << 20


#: Of many damaged files that are alike, one in so many; `make trust` takes them all.
EVERY = {"bad_stations": 4, "bad_models": 3}


@pytest.mark.parametrize("table", corpus.TABLES, ids=lambda table: table.__name__.rpartition(".")[2])
def test_each_is_refused_plainly_or_read_correctly(table: ModuleType, tmp_path: Path) -> None:
    wrong, known = [], []
    every = EVERY.get(table.__name__.rpartition(".")[2], 1)
    for number, case in enumerate(itertools.islice(table.all_cases(), 0, None, every)):
        directory = tmp_path / str(number)
        directory.mkdir()
        try:
            cases.judge(case, directory)
        except Exception as error:
            (known if case.known else wrong).append(f"{case.name}: {type(error).__name__}: {error}")
    assert not wrong, "\n".join(wrong)
    assert len(known) <= 2, known
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss < MOST_MEMORY_KB


def test_there_are_many_and_each_has_its_name() -> None:
    names = [(case.kind, case.name) for case in corpus.all_cases()]
    assert len(names) >= MANY
    assert [name for name in set(names) if names.count(name) > 1] == []


def test_a_judge_that_sees(tmp_path: Path) -> None:
    """Cases that are wrong in themselves: each must be found out."""
    good = cases.written(cases.text())
    for case in (
        cases.Case("log", "not refused", good, ("",)),
        cases.Case("log", "not read", cases.written(""), None),
        cases.Case("log", "read wrongly", good, None, lambda log: len(log) == 1),
        cases.Case("log", "other words", cases.written(""), ("UTF-16",)),
    ):
        with pytest.raises(AssertionError):
            cases.judge(case, tmp_path)
    with pytest.raises(TimeoutError), cases.in_time(1):
        os.read(os.pipe()[0], 1)


def test_what_moves_the_cursor_is_written_out() -> None:
    assert str(InputError("a\x1b[31m\n\u202eb\udcff ü")) == "a\\x1b[31m\\n\\u202eb\\udcff ü"
    assert printable("Höhe 12°") == "Höhe 12°"


def test_a_long_name_does_not_displace_the_cure() -> None:
    for name in ("\x11" * 500, "all one " * 500):
        sentence = str(InputError(f'log.csv: "{name}" is no unit. Rename the column, or give --columns range={name}.'))
        assert "is no unit. Rename the column, or give --columns range=" in sentence
        assert sentence.startswith("log.csv: ")
        assert len(sentence) < cases.LONGEST_SENTENCE
    usual = "log.csv: " + "word " * 200
    assert str(InputError(usual)) == usual


def _limited() -> None:
    resource.setrlimit(resource.RLIMIT_AS, (8 << 30, 8 << 30))


@pytest.mark.parametrize("name", ["gzip bomb", "midnight from 86380.0", "latin-1 in a column kept"])
def test_whole_processes(name: str, tmp_path: Path) -> None:
    """A handful as a user meets them: exit code, one line, no traceback."""
    case = next(case for case in corpus.all_cases() if case.name.endswith(name))
    path = case.make(tmp_path)
    extra = ["--keep-columns"] if case.options else []
    done = _filter(tmp_path, [str(path), "-o", "out.csv", *extra], preexec_fn=_limited)
    assert "Traceback" not in done.stderr
    assert "Warning" not in done.stderr
    if case.says is None:
        assert done.returncode == 0
        assert (tmp_path / "out.csv").exists()
    else:
        assert done.returncode == 1
        assert len(done.stderr.strip().splitlines()) == 1
        assert all(words in done.stderr for words in case.says)
        assert not (tmp_path / "out.csv").exists()


def test_standard_input_without_an_end(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from ftproc.files.reading.formats import content, tables

    endless = tmp_path / "endless"
    endless.write_bytes(b"0,1\n" * 1000)
    monkeypatch.setattr(content, "MAX_STDIN", 1000)
    with endless.open() as stream:
        monkeypatch.setattr(sys, "stdin", stream)
        with pytest.raises(InputError, match="without an end; give a Parquet file"):
            tables.read_header("-")


def _filter(directory: Path, args: list[str], preexec_fn: Callable[[], Any]) -> subprocess.CompletedProcess[str]:
    program = Path(sys.prefix) / "bin" / "ftproc"
    return subprocess.run(
        [program, "filter", *args], cwd=directory, capture_output=True, text=True, timeout=120, preexec_fn=preexec_fn
    )
