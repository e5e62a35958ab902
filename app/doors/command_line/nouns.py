"""`pyroshock NOUN list|show|delete`: one grammar for everything that the store holds."""

from __future__ import annotations

import click
from click.core import ParameterSource
from click.shell_completion import CompletionItem

from .common import CommandGroup


class NounGroup(CommandGroup):
    """A group whose own options count for the command after them: `datasets --db URL show spring`.

    `otherwise` names the command that takes a word which is no command: `models hybrid@3` is
    `models show hybrid@3`.
    """

    otherwise: str | None = None

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if self.otherwise is not None and self.get_command(ctx, args[0]) is None:
            args = [self.otherwise, *args]
        name, command, rest = super().resolve_command(ctx, args)
        return name, command, [*_typed_before(ctx, command), *rest]

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """Commands and options, and what the command `otherwise` takes first."""
        items = super().shell_complete(ctx, incomplete)
        if self.otherwise is None or incomplete.startswith("-"):
            return items
        command = self.get_command(ctx, self.otherwise)
        assert command is not None
        return items + command.params[0].shell_complete(
            click.Context(command, parent=ctx), incomplete
        )


def _typed_before(ctx: click.Context, command: click.Command | None) -> list[str]:
    """The words of the group's options that were typed, as far as the command has options of the
    same names."""
    words: list[str] = []
    taken = (
        {option.name for option in command.params if isinstance(option, click.Option)}
        if command
        else set()
    )
    for option in ctx.command.params:
        name = option.name or ""
        if name not in taken or ctx.get_parameter_source(name) is not ParameterSource.COMMANDLINE:
            continue
        value = ctx.params.get(name)
        if isinstance(option, click.Option) and option.is_flag:
            words.append(option.opts[-1])
        else:
            for item in value if isinstance(value, tuple) else (value,):
                words += [option.opts[-1], str(item)]
    return words
