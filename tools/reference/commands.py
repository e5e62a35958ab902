"""Every command with its options, as click knows them."""

from __future__ import annotations

import re
from collections.abc import Iterator

import click
from pyroshock.app.doors.command_line.main import main

from .markdown import code, escaped, joined, prose, table

#: What click does not know stands at the end of an option's help: that it is required, and a
#: default of the request or in words, as "[default: 10]" and "[default: drawn and reported]".
_REQUIRED = re.compile(r"\s*\[required\]$")
_DEFAULT = re.compile(r"\s*\[default:? ([^\]]+)\]$")


def commands() -> Iterator[tuple[click.Context, click.Command]]:
    """Every command and subcommand, each after the group that it is of."""
    yield from _below(click.Context(main, info_name="pyroshock"), main)


def page() -> str:
    """A section a command: usage, what it does, its options."""
    return joined(
        *(
            _section(context, command)
            for context, command in commands()
            if context.parent is not None
        )
    )


def options_of(command: click.Command) -> list[click.Option]:
    """Its options in the order of its help, without `--help`."""
    return [each for each in command.params if isinstance(each, click.Option) and not each.hidden]


def _below(
    context: click.Context, command: click.Command
) -> Iterator[tuple[click.Context, click.Command]]:
    yield context, command
    if isinstance(command, click.Group):
        for name in command.list_commands(context):
            part = command.get_command(context, name)
            assert part is not None
            yield from _below(click.Context(part, info_name=name, parent=context), part)


def _section(context: click.Context, command: click.Command) -> str:
    level = "#" * (len(context.command_path.split()))
    usage = " ".join([context.command_path, *command.collect_usage_pieces(context)])
    rows = [_row(context, option) for option in options_of(command)]
    options = table(["option", "default", "what it does"], rows)
    return joined(
        f"{level} {context.command_path}", f"```\n{usage}\n```", prose(command.help), options
    )


def _row(context: click.Context, option: click.Option) -> tuple[str, str, str]:
    record, extra = option.get_help_record(context), option.get_help_extra(context)
    assert record is not None
    words = _REQUIRED.sub("", option.help or "")
    required = option.required or words != (option.help or "")
    default = "required" if required else code(extra["default"]) if "default" in extra else ""
    if not default and (stated := _DEFAULT.search(words)):
        words = words[: stated.start()]
        default = escaped(stated[1]) if " " in stated[1] else code(stated[1])
    notes = [words and escaped(words)]
    if option.multiple and "repeat" not in words:
        notes.append("May be repeated.")
    if "range" in extra:
        notes.append(f"{code(extra['range'])}.")
    if extra.get("envvars"):
        notes.append(f"Or the variable {', '.join(code(name) for name in extra['envvars'])}.")
    return code(record[0]), default, " ".join(note for note in notes if note)
