"""`pyroshock NOUN list|show|delete`: one grammar for everything that the store holds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import click
from click.core import ParameterSource
from click.shell_completion import CompletionItem

from .common import CommandGroup


class NounGroup(CommandGroup):
    """A group whose own options count for the command after them: `datasets --db URL show spring`.

    `otherwise` names the command that takes a word which is no command: `models hybrid@3` is `models show hybrid@3`.
    """

    otherwise: str | None = None

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if self.otherwise is not None and args[0] not in self.commands:
            args = [self.otherwise, *args]
        name, command, rest = super().resolve_command(ctx, args)
        typed = {
            key: value
            for key, value in ctx.params.items()
            if ctx.get_parameter_source(key) is ParameterSource.COMMANDLINE
        }
        if name is not None and typed:
            ctx.default_map = {name: typed}
        return name, command, rest

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """Commands and options, and what the command `otherwise` takes first."""
        items = super().shell_complete(ctx, incomplete)
        if self.otherwise is None or incomplete.startswith("-"):
            return items
        command = self.commands[self.otherwise]
        return items + command.params[0].shell_complete(click.Context(command, parent=ctx), incomplete)


def noun_group(
    listing: click.Command, commands: Mapping[str, click.Command], text: str, *, otherwise: str | None = None
) -> NounGroup:
    """The group of a noun: alone it does what `listing` does, with its options, and `list` is the same command."""

    def alone(context: click.Context, /, **given: Any) -> None:
        if context.invoked_subcommand is None:
            assert listing.callback is not None
            listing.callback(**given)

    group = NounGroup(
        callback=click.pass_context(alone),
        params=listing.params,
        help=text,
        invoke_without_command=True,
        commands={"list": listing, **commands},
    )
    group.otherwise = otherwise
    return group
