"""What stands in the pages is what the commands print now, and links lead somewhere."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import ftproc
from tests.docs import picture
from tests.docs.blocks import BLOCKS, session, table
from tests.docs.pages import PAGES, filled, texts
from tests.docs.shell import ROOT, Shell

NUMBER = re.compile(r"[-+]?(?:\d+\.\d+(?:e[-+]\d+)?|\d\.?\d*e[-+]\d+)")  # not a count
MOST_LINES = 200
LONG = dict.fromkeys(("train", "train-use", "all-methods"), pytest.mark.slow)  # blocks that the commands take long for


@pytest.fixture(scope="module")
def shell(tmp_path_factory: pytest.TempPathFactory) -> Shell:
    return Shell(tmp_path_factory.mktemp("scratch"))


def standing() -> dict[str, str]:
    return {name: text for page in PAGES for name, text in texts(page.read_text(encoding="utf-8")).items()}


def same(one: str, other: str) -> bool:
    """Words and counts agree, and other numbers to one in a hundred: processors round differently."""
    figures = [[float(n) for n in NUMBER.findall(text)] for text in (one, other)]
    words = [NUMBER.sub("0", text).split() for text in (one, other)]
    return words[0] == words[1] and figures[0] == pytest.approx(figures[1], rel=0.01, abs=0.001)


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=LONG.get(name, [])) for name, block in BLOCKS.items() if not block.slow]
)
def test_a_block_is_what_its_commands_print_now(name: str, shell: Shell) -> None:
    assert same(standing()[name], BLOCKS[name].text(name, shell)), f"run: make readme BLOCKS={name}"


def test_a_model_is_trained_and_used_by_the_commands_of_the_page(tmp_path: Path) -> None:
    """On a short flight, with little effort: words, not figures, are those of the page."""
    place, used = Shell(tmp_path), BLOCKS["train-use"]
    fly, train, fly_again = used.before
    for command in (
        fly.replace("--duration 600", "--duration 140"),
        fly_again.replace("--duration 200", "--duration 40"),
    ):
        place.output(command)
    said = place.output(f"{train} --epochs 3 --population 4 --generations 1")
    assert all(f"\n{words}" in said for words in ("filter: ", "smoother: ", "Position error"))
    scores = [place.output(command) for command in used.commands][-1]
    assert all(
        words in standing()["train-use"] and words in scores for words in ("plain", "corrected", "position RMSE")
    )


def test_every_block_stands_on_one_page_under_its_command() -> None:
    marks = [m for page in PAGES for m in re.findall(r"<!-- BEGIN ([\w-]+): (.*) -->", page.read_text())]
    assert sorted(marks) == sorted((name, block.commands[-1]) for name, block in BLOCKS.items())
    assert all(standing().values())


def test_numbers_may_be_rounded_differently_and_words_and_counts_may_not() -> None:
    assert same("RMSE 1.234 m of 61", "RMSE  1.235 m\nof 61")
    assert not same("RMSE 1.234 m of 61", "RMSE 1.3 m of 61")
    assert not same("RMSE 1.234 m of 61", "RMSE 1.234 m of 62")
    assert not same("it helps: 0.5", "it harms: 0.5")


PAGE = "a\n<!-- BEGIN one: old -->\nold\n<!-- END one -->\n<!-- BEGIN two: b -->\nkept\n<!-- END two -->\n"


def test_only_what_stands_between_the_marks_of_a_block_is_replaced() -> None:
    page = filled(PAGE, {"one": ("new", "made\n"), "three": ("c", "d\n")})
    assert page == PAGE.replace("one: old -->\nold\n", "one: new -->\nmade\n")
    assert texts(page) == {"one": "made\n", "two": "kept\n"}


@pytest.mark.parametrize("broken", [PAGE.replace("END one", "END oen"), PAGE + PAGE])
def test_marks_without_a_partner_and_twice_the_same(broken: str) -> None:
    with pytest.raises(ValueError, match="whole"):
        texts(broken)


def test_a_session_shows_its_commands_and_leaves_out_the_time(shell: Shell) -> None:
    made = session("printf 'a 1\\n  time       2 s\\nb -\\nc 3\\n'", "printf 'd 4\\ne 5\\nf 6\\nd -\\n'", only=("d",))
    assert made.text("x", shell).splitlines() == [
        "```text", "$ printf 'a 1\\n  time       2 s\\nb -\\nc 3\\n'", "a 1", "b -", "c 3",
        "$ printf 'd 4\\ne 5\\nf 6\\nd -\\n'", "d 4", "...", "```",
    ]  # fmt: skip


def test_a_table_leaves_out_a_column_and_names_its_command(shell: Shell) -> None:
    command = "printf 'A title.\\n\\n| a | b |\\n| --- | --- |\\n| 1 | 2 |\\n'"
    made = table(command, slow=False, note="; roughly", without="a")
    assert made.text("x", shell) == f"| b |\n| --- |\n| 2 |\n\nPrinted by `{command}`; roughly.\n"


def test_a_command_that_fails_is_no_text(shell: Shell) -> None:
    with pytest.raises(RuntimeError, match="there is no such file"):
        session("ftproc score none.csv").text("x", shell)


def test_the_picture_is_drawn_the_same_again(tmp_path: Path) -> None:
    log = ftproc.read_log(picture.LOG)
    trajectory = ftproc.filter_log(log)
    for name in ("one.png", "two.png"):
        picture.save(picture.draw(log, trajectory), tmp_path / name)
    assert (tmp_path / "one.png").read_bytes() == (tmp_path / "two.png").read_bytes()
    assert picture.FILE.read_bytes().startswith(b"\x89PNG")
    assert picture.FILE.stat().st_size < 150_000


def test_the_readme_is_short() -> None:
    assert len(PAGES[0].read_text(encoding="utf-8").splitlines()) <= MOST_LINES


def links() -> Iterator[tuple[Path, str]]:
    for page in PAGES:
        text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
        yield from ((page, link) for link in re.findall(r"\]\(([^)]+)\)", text))


def anchors(page: Path) -> set[str]:
    titles = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", title).lower().replace(" ", "-") for title in titles}


@pytest.mark.parametrize(("page", "link"), list(links()), ids=lambda part: str(part)[-30:])
def test_links_lead_somewhere(page: Path, link: str) -> None:
    name, _, anchor = link.partition("#")
    target = page.parent / name if name else page
    assert target.exists()
    assert not anchor or anchor in anchors(target)


def test_paths_named_in_the_guide_exist() -> None:
    guide = ROOT / "ftproc" / "README.md"
    named = re.findall(r"`((?:core|tests|correction|quality|files)/[\w/.]+)`", guide.read_text(encoding="utf-8"))
    assert len(named) > 10
    for name in named:
        assert (ROOT / name).exists() or (ROOT / "ftproc" / name).exists(), name
