"""Marks in Markdown pages, and the text between them: <!-- BEGIN name: command --> ... <!-- END name -->."""

from __future__ import annotations

import re
from collections.abc import Mapping

from tests.docs.shell import ROOT

PAGES = tuple(
    ROOT / name for name in ("README.md", "ftproc/README.md", "ftproc/cli/README.md", "ftproc/batch/README.md")
)
_BLOCK = re.compile(r"<!-- BEGIN (?P<name>[\w-]+): (?P<command>.*) -->\n(?P<text>.*?)<!-- END (?P=name) -->", re.DOTALL)
_MARK = re.compile(r"<!-- (?:BEGIN|END) ")


def texts(page: str) -> dict[str, str]:
    """The text of every block of a page, by name. Raises ValueError for a mark without its partner and for a name that
    stands twice."""
    found = {block["name"]: block["text"] for block in _BLOCK.finditer(page)}
    if len(_MARK.findall(page)) != 2 * len(found):
        raise ValueError(f"the marks of these blocks are the only whole ones: {', '.join(found)}")
    return found


def filled(page: str, made: Mapping[str, tuple[str, str]]) -> str:
    """The page with new commands and texts of the blocks in `made`; the rest stays as it is."""

    def block(old: re.Match[str]) -> str:
        command, text = made.get(old["name"], (old["command"], old["text"]))
        return f"<!-- BEGIN {old['name']}: {command} -->\n{text}<!-- END {old['name']} -->"

    return _BLOCK.sub(block, page)
