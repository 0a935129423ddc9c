"""`make readme`: write the outputs of commands into the pages, and draw the picture.

python -m tests.docs [--slow] [--kept] [NAME...]
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from pathlib import Path

from tests.docs import picture
from tests.docs.blocks import BLOCKS
from tests.docs.pages import PAGES, filled
from tests.docs.shell import Shell


def main() -> None:
    """Make the blocks that are named, or all that take seconds; the others stay as they are."""
    parser = argparse.ArgumentParser(prog="python -m tests.docs", description=main.__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"one of {', '.join(BLOCKS)}")
    parser.add_argument("--slow", action="store_true", help="also those that take minutes")
    parser.add_argument("--kept", action="store_true", help="slow ones from the output kept in out/readme; run nothing")
    asked = parser.parse_args()
    if unknown := set(asked.names) - set(BLOCKS):
        parser.error(f"there is no block {', '.join(sorted(unknown))}; there are {', '.join(BLOCKS)}")
    if not asked.names:
        picture.main()
    names = asked.names or [
        name
        for name, block in BLOCKS.items()
        if (asked.slow or not block.slow) and (not block.needs or block.needs in os.environ)
    ]
    with tempfile.TemporaryDirectory() as folder:
        shell = Shell(Path(folder), asked.kept)
        for name in names:
            print(f"{name}: {BLOCKS[name].commands[-1]}", file=sys.stderr, flush=True)
            made = {name: (BLOCKS[name].commands[-1], BLOCKS[name].text(name, shell))}
            for page in PAGES:
                page.write_text(filled(page.read_text(encoding="utf-8"), made), encoding="utf-8")


if __name__ == "__main__":
    main()
