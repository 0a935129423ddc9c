"""Security: no code from files, no formulas in tables, no outputs outside the directory of -o."""

from __future__ import annotations

import ast
import csv
import io
import unicodedata
from pathlib import Path

import pyarrow as pa
import pytest
from click.testing import CliRunner

import ftproc
from ftproc.batch import plan
from ftproc.cli.main import cli
from ftproc.files.writing import csvtext, tables
from tests.trust import cases

PACKAGE = Path(ftproc.__file__).parent

#: Modules that run the content of a file or string, or a shell. (numba's cache of kernels, and the pipes between our
#: own processes, use pickle inside those libraries; no file of a user goes that way.)
_MODULES = {
    "pickle",
    "cPickle",
    "dill",
    "cloudpickle",
    "marshal",
    "shelve",
    "subprocess",
    "pty",
    "joblib",
    "yaml",
    "code",
}
_CALLS = {"eval", "exec", "compile", "__import__", "input"}
_METHODS = {"system", "popen", "spawnl", "spawnv", "execv", "execvp", "read_pickle", "to_pickle", "load_pickle"}


def offences(source: str) -> list[str]:
    """What a module must not use, with its line."""
    found = []
    for node in ast.walk(ast.parse(source)):
        names: list[str] = []
        if isinstance(node, ast.Import):
            names = [alias.name.partition(".")[0] for alias in node.names if alias.name.partition(".")[0] in _MODULES]
        elif isinstance(node, ast.ImportFrom):
            names = [node.module or ""] if (node.module or "").partition(".")[0] in _MODULES else []
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            names = [node.func.id] if node.func.id in _CALLS else []
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            names = [node.func.attr] if node.func.attr in _METHODS else []
        elif isinstance(node, ast.keyword) and node.arg in ("shell", "allow_pickle"):
            names = [] if isinstance(node.value, ast.Constant) and node.value.value is False else [node.arg]
        found += [f"line {getattr(node, 'lineno', 0)}: {name}" for name in names]
    return found


def test_no_code_from_files_is_run() -> None:
    """One module starts a process, without a shell: the browser that prints a page."""
    for path in PACKAGE.rglob("*.py"):
        printing = path.relative_to(PACKAGE).as_posix() == "report/browser/printing.py"
        assert [what.partition(": ")[2] for what in offences(path.read_text())] == ["subprocess"] * printing, path


@pytest.mark.parametrize(
    "source",
    ["import pickle", "from pickle import loads", "eval('1')", "import os\nos.system('x')", "f(shell=True)", "exec(x)"],
)
def test_the_search_finds_them(source: str) -> None:
    assert offences(source)


#: Of the characters that show nothing, and of what looks like a sign, as Unicode knows them.
UNSEEN = [chr(c) for c in range(0x110000) if unicodedata.category(chr(c)) in ("Cc", "Cf", "Zs", "Zl", "Zp")]
SIGNS = [chr(c) for c in range(0x110000) if unicodedata.normalize("NFKC", chr(c))[:1] in tuple("=+-@")]
BEFORE = ["   ", "\xa0", "\u200b", "\ufeff", " \u200b\xa0 ", "\u2060\t", "\x00", "\u3164"]
FORMULAS = [f"{unseen}=1+1" for unseen in [*UNSEEN, *BEFORE]]
FORMULAS += [f"{before}{sign}cmd|'!A0" for sign in SIGNS for before in ("", " ")]
FORMULAS += ["=1+1", "+cmd|' /C calc'!A0", "-2+3", "@SUM(A1)", "\t=1", "\r=1", "=", "-", "+1e5x"]
HARMLESS = ["-5", "+5", "-1.5e-3", "-.5", "a=b", "Höhe", "", "'=1", "5-3", " -5", "\xa0-1e3 ", " x", "\ufefftime"]


@pytest.mark.parametrize("kind", [pa.string(), pa.large_string(), pa.binary(), pa.dictionary(pa.int32(), pa.string())])
def test_text_is_no_formula_and_numbers_stay_numbers(kind: pa.DataType) -> None:
    texts = pa.array([*FORMULAS, *HARMLESS, None])
    table = pa.table({"=name": texts.cast(kind), "n": [-1.5] * len(texts)})
    sink = io.BytesIO()
    tables.write_stream(table, sink, ".csv")
    found = list(csv.reader(io.StringIO(sink.getvalue().decode(), newline="")))
    assert found[0] == ["'=name", "n"]
    assert [row[0] for row in found[1:]] == [f"'{text}" for text in FORMULAS] + [*HARMLESS, ""]
    assert {row[1] for row in found[1:]} == {"-1.5"}
    assert [csvtext.no_formula(text) for text in HARMLESS] == HARMLESS


def test_kept_columns_and_scores_are_no_formulas(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    content = cases.text([[*row, "=1+1", "-7"] for row in cases.rows()], cases.HEADER + ",@note,-count")
    Path("=log.csv").write_text(content)
    run = CliRunner().invoke(cli, ["filter", "=log.csv", "--keep-columns"])
    assert run.exit_code == 0, run.stderr
    rows = list(csv.DictReader(io.StringIO(Path("=log.trajectory.csv").read_text())))
    assert {row["'@note"] for row in rows} == {"'=1+1"}
    assert {row["'-count"] for row in rows} == {"-7"}
    scored = CliRunner().invoke(cli, ["score", "=log.trajectory.csv", "--format", "csv"])
    cells = next(csv.DictReader(io.StringIO(scored.stdout)))
    assert "'=log.trajectory.csv" in cells.values()


@pytest.mark.parametrize("log", ["../a.csv", "../../../../etc/a.csv", "/etc/..csv", "x/../../b.parquet", "..", "."])
def test_outputs_stay_in_the_directory_asked_for(log: str, tmp_path: Path) -> None:
    for task in plan.tasks([plan.Wanted(log)], f"{tmp_path}/out/"):
        assert Path(task.output).resolve().parent == (tmp_path / "out").resolve()


def test_names_do_not_move_the_cursor(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a\x1b[31m.csv").write_text(cases.text())
    run = CliRunner().invoke(cli, ["filter", "a\x1b[31m.csv"])
    assert run.exit_code == 0
    assert "\x1b" not in run.stdout + run.stderr
    assert "a\\x1b[31m.csv" in run.stdout
