"""The structure of the package: which folder may call which, how large folders, files and signatures may be, and that
each folder says what is in it. Imports are read, not made, so that those inside functions count too."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parent.parent / "ftproc"
MOST_FILES, MOST_LINES, MOST_PARAMETERS = 14, 300, 7

#: The rooms from the ground up: each may call itself and those before it, no other.
FLOORS = (
    ("errors", "settings"),
    ("records", "order_statistics", "__init__"),
    ("long_records",),
    (
        "core.by_hand",
        "core.signatures",
        "core.components",
        "core.threads",
        "core.processes",
        "core.pacing",
        "core.work",
        "core.odds",
    ),
    ("core.compiled",),
    ("core.model",),
    ("core.filtering",),
    ("core.identification",),
    ("core.editing",),
    ("core.beside", "core.impact"),
    ("core.comparators", "core.live"),
    ("files", "simulation"),
    ("files.reading", "files.writing"),
    ("derived",),
    ("scoring",),
    ("methods", "correction"),
    ("quality",),
    ("correction.training",),
    ("pipeline",),
    ("config", "report"),
    ("live",),
    ("fusion.estimation",),
    ("fusion",),
    ("report.fused",),
    ("batch",),
    ("api",),
    ("cli",),
    ("__main__",),
)


@cache
def modules() -> tuple[str, ...]:
    paths = (path.relative_to(PACKAGE).with_suffix("") for path in PACKAGE.rglob("*.py"))
    return tuple(".".join(p.parts[:-1] if p.name == "__init__" and len(p.parts) > 1 else p.parts) for p in paths)


def source(module: str) -> Path:
    path = PACKAGE / Path(*module.split("."))
    return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")


def imported(text: str, known: set[str]) -> Iterator[str]:
    """Modules of the package that a module imports anywhere, for its types only too."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            yield from (a.name.removeprefix("ftproc.") for a in node.names if a.name.startswith("ftproc."))
        elif isinstance(node, ast.ImportFrom) and node.module is not None and node.module.split(".")[0] == "ftproc":
            assert node.level == 0
            inside = node.module.removeprefix("ftproc").removeprefix(".")
            for alias in node.names:
                full = f"{inside}.{alias.name}".removeprefix(".")
                yield full if full in known else inside or "__init__"
        else:
            assert not (isinstance(node, ast.ImportFrom) and node.level), "imports are absolute"


def floor(module: str) -> int:
    """The floor of the innermost room that a module is in."""
    rooms = {room: number for number, rooms in enumerate(FLOORS) for room in rooms}
    found = [room for room in rooms if module == room or module.startswith(f"{room}.")]
    assert found, f"ftproc.{module} is in no room of FLOORS"
    return rooms[max(found, key=len)]


def room(module: str) -> str:
    rooms = [room for rooms in FLOORS for room in rooms if module == room or module.startswith(f"{room}.")]
    return max(rooms, key=len)


def wrong(module: str, text: str, known: set[str]) -> list[str]:
    """The arrows of a module that go up, or to a neighbour's room on the same floor."""
    return [
        other
        for other in imported(text, known)
        if floor(other) > floor(module) or (floor(other) == floor(module) and room(other) != room(module))
    ]


@pytest.mark.parametrize("module", [m for m in modules() if m not in ("__init__", "core")])
def test_no_arrow_goes_up(module: str) -> None:
    found = wrong(module, source(module).read_text(), set(modules()))
    assert not found, f"ftproc.{module} imports {found}"


def test_an_arrow_turned_round_is_seen() -> None:
    known = set(modules())
    assert wrong("core.model.motion", "def f():\n    from ftproc.core.filtering import ukf\n", known)
    assert wrong("records", "from ftproc import report\n", known)
    assert wrong("files.writing.maps", "from ftproc.files.reading import logs\n", known)
    assert not wrong("cli.filter", "from ftproc.core.model import motion\n", known)


def test_no_circle() -> None:
    known = set(modules())
    arrows = {m: {o for o in imported(source(m).read_text(), known) if o != m} for m in known}
    arrows["__init__"] = set()  # loads api when it is asked for a name
    while ends := {m for m, others in arrows.items() if not others & set(arrows)}:
        for m in ends:
            del arrows[m]
    assert not arrows, f"these import each other: {sorted(arrows)}"


def test_rooms_and_files_have_a_size_that_can_be_seen_at_once() -> None:
    for folder in {path.parent for path in PACKAGE.rglob("*.py")}:
        files = [path.name for path in folder.iterdir() if path.is_file()]
        assert len(files) <= MOST_FILES, f"{folder} holds {len(files)} files"
    for path in [*PACKAGE.rglob("*.py"), *Path(__file__).parent.rglob("*.py")]:
        assert len(path.read_text().splitlines()) <= MOST_LINES + 100 * ("tests" in path.parts), path


def test_what_travels_together_travels_as_one_record() -> None:
    for path in PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.FunctionDef):
                given = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
                own = [argument.arg for argument in given if argument.arg not in ("self", "cls")]
                assert len(own) <= MOST_PARAMETERS, f"{path}:{node.lineno} {node.name} takes {len(own)}"


def test_every_room_says_who_lives_there() -> None:
    for path in PACKAGE.rglob("__init__.py"):
        assert ast.get_docstring(ast.parse(path.read_text())), f"{path} says nothing"
