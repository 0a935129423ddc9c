"""The command reference, from the code: python -m ftproc.cli.reference > ftproc/cli/README.md"""

from __future__ import annotations

import click

from ftproc.cli.main import COMMANDS, cli

_WIDTH = 110
_HEAD = """\
# Command reference

What `ftproc -h` and `ftproc COMMAND -h` say, written by `python -m ftproc.cli.reference`. Which options you need for
what is told in [Choose your options](../README.md).
"""


def text() -> str:
    """The reference as Markdown."""
    program = click.Context(cli, info_name="ftproc", terminal_width=_WIDTH, max_content_width=_WIDTH)
    parts = [_HEAD, _section("ftproc", cli.get_help(program))]
    for name in COMMANDS:
        command = cli.get_command(program, name)
        assert command is not None
        context = click.Context(
            command, program, name, terminal_width=_WIDTH, max_content_width=_WIDTH, **command.context_settings
        )
        parts.append(_section(f"ftproc {name}", command.get_help(context)))
    return "\n".join(parts)


def _section(title: str, help_text: str) -> str:
    lines = "\n".join(line.rstrip() for line in help_text.strip().splitlines())
    return f"## {title}\n\n```text\n{lines}\n```\n"


if __name__ == "__main__":
    click.echo(text(), nl=False)
