"""What every command has in common: `-h`, `--debug`, a help that ends with examples to copy, a quick start."""

from __future__ import annotations

import gc
import sys
from collections.abc import Callable
from typing import Any

import click

CONTEXT = {"help_option_names": ["-h", "--help"], "max_content_width": 100}


DEBUG = "--debug"


def debug_option() -> click.Option:
    """`--debug`, before or after the command's name."""

    def remember(ctx: click.Context, param: click.Parameter, value: bool) -> None:
        ctx.meta[DEBUG] = value or ctx.meta.get(DEBUG, False)

    text = "Show where an error came from (Python traceback)."
    return click.Option([DEBUG], is_flag=True, expose_value=False, callback=remember, help=text)


class Command(click.Command):
    """A command whose help ends with `examples`, one shell command per line.

    more: text for the help that is only known at run time, such as a list of names; asked for when it is shown.
    """

    def __init__(self, *args: Any, examples: str, more: Callable[[], str] | None = None, **attributes: Any) -> None:
        attributes["context_settings"] = {**CONTEXT, "show_default": True}
        super().__init__(*args, **attributes)
        self.examples, self.more = examples, more
        self.params.append(debug_option())

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        if self.more is not None:
            formatter.write("\n" + self.more().rstrip() + "\n")
        write_examples(formatter, self.examples)


def write_examples(formatter: click.HelpFormatter, examples: str) -> None:
    """The last section of a help; its lines are not wrapped, so that they can be copied."""
    lines = "".join(f"  {line.strip()}\n" for line in examples.strip().splitlines())
    formatter.write(f"\nExamples:\n{lines}")


def hasten() -> None:
    """Do what makes the first result of a process come sooner; before numba is loaded."""
    gc.set_threshold(100_000, 50, 50)  # loading modules makes many objects and hardly any garbage
    _spare_blas()


def _spare_blas() -> None:
    """Keep numba from looking for SciPy's BLAS, which loads much of SciPy: no kernel here multiplies matrices by it.

    numba asks once, when its array functions are first needed, and takes "not there" for an answer.
    """
    name = "scipy.linalg.cython_blas"
    if name in sys.modules or "numba" in sys.modules:
        return
    sys.modules[name] = None  # type: ignore[assignment]
    try:
        import numba.np.arraymath  # noqa: F401
    finally:
        del sys.modules[name]
