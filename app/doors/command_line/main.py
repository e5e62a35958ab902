"""`pyroshock`: the command line. Commands are imported when they are called, so that help is
instant."""

from __future__ import annotations

import atexit
import gc
import importlib
import sys
from collections.abc import Sequence
from functools import cache
from typing import Any

import click
from click.shell_completion import CompletionItem

from ....parallel.working_directory import close_working_directory
from ...operations.catalogue import commands_of_noun, operation
from ...operations.command_words import COMMANDS, NOUNS, SECTIONS
from .shells import register_shells

#: Commands that are no operation, or more than one -> (module of the package, its object).
OTHERS: dict[str, tuple[str, str]] = {
    "serve": (".app.server.command", "serve"),
    "demo": (".app.demo.command", "demo"),
}


@cache
def _command(word: str) -> click.Command:
    """The command of a word of the help, which alone is imported."""
    from .operation_command import command_of
    from .operation_group import OperationGroup

    if word in OTHERS:
        gc.enable()  # its program may run for weeks
        module, name = OTHERS[word]
        command = getattr(importlib.import_module(module, __package__.partition(".")[0]), name)
        assert isinstance(command, click.Command)
        return command
    if word in NOUNS:
        return OperationGroup(word)
    return command_of(operation(commands_of_noun(word)[""]))


class LazyGroup(click.Group):
    """A group that knows its commands' names and imports one only to run it."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        return _command(cmd_name) if cmd_name in COMMANDS else None

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """Commands by the table, which imports none of them; then options."""
        named = [CompletionItem(name, help=text) for name, text in COMMANDS.items()]
        options = click.Command.shell_complete(self, ctx, incomplete)
        return [item for item in named if item.value.startswith(incomplete)] + options

    def main(  # type: ignore[override]  # click's overloads, one of which never returns
        self, args: Sequence[str] | None = None, *, standalone_mode: bool = True, **extra: Any
    ) -> Any:
        """Run, and end every error as one line on standard error with exit code 2."""
        register_shells()
        if not standalone_mode:
            return super().main(args, standalone_mode=False, **extra)
        if args is None:  # the process was started for this command, and is nobody else's
            close_working_directory()
            # Until its work begins a command makes nothing but modules, which stay, and at the end
            # all memory goes at once: to search it for garbage then takes 0.3 s.
            gc.disable()
            atexit.register(gc.freeze)
        try:
            # click returns the code of an early exit, and None of a command that ran through
            code = super().main(args, standalone_mode=False, **extra)
        except click.exceptions.NoArgsIsHelpError as error:
            error.show()
            sys.exit(2)
        except click.ClickException as error:
            from ....schema.addresses import without_secrets

            click.echo(
                f"pyroshock: {' '.join(without_secrets(_message_of(error)).split())}", err=True
            )
            sys.exit(2)
        except (click.Abort, KeyboardInterrupt):
            click.echo(
                "pyroshock: interrupted; what was stored is whole, and a repeat goes on from there",
                err=True,
            )
            sys.exit(130)
        sys.exit(code or 0)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        width = max(map(len, COMMANDS))
        for title, commands in SECTIONS.items():
            with formatter.section(title):
                formatter.write_dl([(name.ljust(width), text) for name, text in commands.items()])


def _message_of(error: click.ClickException) -> str:
    """The error, and which commands there are where one was asked for that there is not."""
    message = error.format_message()
    context = error.ctx if isinstance(error, click.UsageError) else None
    if (
        not message.startswith("No such command")
        or context is None
        or not isinstance(context.command, click.Group)
    ):
        return message
    names = context.command.list_commands(context)
    if context.command is main:
        from difflib import get_close_matches

        near = get_close_matches(getattr(error, "command_name", ""), names)
        names = near and [f"did you mean {', '.join(near)}?"]
    return f"{message.partition('.')[0]}; {', '.join(names) or 'pyroshock --help lists them'}"


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="pyroshock", message="pyroshock %(version)s")
def main() -> None:
    """Experiment database, models and digital twin for pyroshock testing.

    \b
    Example:
        pyroshock demo
        pyroshock ingest results/rehearsal/
        pyroshock impacts --where tip_material=steel
    """
