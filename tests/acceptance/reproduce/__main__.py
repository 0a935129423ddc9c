"""`python -m tests.acceptance.reproduce [NAME...]`: write out/reproduce/reproduce.md and its plots."""

from __future__ import annotations

import importlib
import pkgutil
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType

from tests.acceptance import reproduce
from tests.acceptance.reproduce.page import Page

OUT = Path("out/reproduce")
_INTRODUCTION = """# The papers' experiments, reproduced

Made by `make reproduce`. The papers give neither their data nor all of their settings: flights are simulated after
their descriptions, with fixed seeds, and what they leave open is said in each section. Where a paper gives a figure it
stands beside ours; a claim is marked by whether it came out.
"""


def experiments() -> dict[str, ModuleType]:
    """The modules with a `section`, by name, in the order of the page."""
    names = [m.name for m in pkgutil.iter_modules(reproduce.__path__) if not m.name.startswith("_")]
    every = {name: importlib.import_module(f"{reproduce.__name__}.{name}") for name in names}
    modules = {name: module for name, module in every.items() if hasattr(module, "section")}
    return dict(sorted(modules.items(), key=lambda item: (getattr(item[1], "ORDER", 99), item[0])))


def main(arguments: Sequence[str], out: Path = OUT) -> None:
    """Write the page; experiments that are not named keep the sections that they have."""
    found = experiments()
    if unknown := set(arguments) - set(found):
        sys.exit(f"there is no experiment {', '.join(sorted(unknown))}; there are {', '.join(found)}")
    out.mkdir(parents=True, exist_ok=True)
    kept = [out / f"{name}.section.md" for name in found]
    for path, (name, module) in zip(kept, found.items(), strict=True):
        if not arguments or name in arguments:
            began = time.monotonic()
            path.write_text(module.section(Page(out)), encoding="utf-8")
            print(f"{name}: {time.monotonic() - began:.0f} s", file=sys.stderr, flush=True)
    target = out / "reproduce.md"
    sections = [path.read_text(encoding="utf-8") for path in kept if path.exists()]
    target.write_text("\n".join([_INTRODUCTION, *sections]), encoding="utf-8")
    print(f"-> {target}")


if __name__ == "__main__":
    main(sys.argv[1:])
