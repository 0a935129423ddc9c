"""The command reference, from the code: python -m tests.docs.reference > ftproc/cli/README.md"""

from __future__ import annotations

import click

from ftproc.cli.main import COMMANDS, cli

_WIDTH = 110
_HEAD = """\
# Command reference

The output of `ftproc -h` and `ftproc COMMAND -h`, written by `python -m tests.docs.reference`. For which options to use
see [Choose your options](../README.md).
"""


def text() -> str:
    """The reference as Markdown."""
    program = _context(cli, None, "ftproc")
    parts = [_HEAD, _section("ftproc", cli.get_help(program))]
    for name in COMMANDS:
        command = cli.get_command(program, name)
        assert command is not None
        parts.append(_section(f"ftproc {name}", command.get_help(_context(command, program, name))))
    return "\n".join(parts)


def _context(command: click.Command, parent: click.Context | None, name: str) -> click.Context:
    settings = {**command.context_settings, "max_content_width": _WIDTH, "terminal_width": _WIDTH}
    return click.Context(command, parent, name, **settings)


def _section(title: str, help_text: str) -> str:
    lines = "\n".join(line.rstrip() for line in help_text.strip().splitlines())
    return f"## {title}\n\n```text\n{lines}\n```\n"


if __name__ == "__main__":
    click.echo(text(), nl=False)
