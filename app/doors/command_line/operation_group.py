"""`pyroshock NOUN COMMAND`: commands of a noun are operations, imported when they are called."""

from __future__ import annotations

from typing import Any

import click

from ...operations.catalogue import commands_of_noun, operation
from ...operations.command_words import COMMANDS, NOUNS, OTHERWISE
from .nouns import NounGroup


class OperationGroup(NounGroup):
    """The commands below a noun. Alone the noun does what its command `list` does.

    A word that is no command may be the method of an operation with variants: `plan lhs`.
    """

    def __init__(self, noun: str) -> None:
        self.noun, self.otherwise = noun, OTHERWISE.get(noun)
        self._operations = commands_of_noun(noun)
        listing = self.get_command_of("list") if "list" in self._operations else None
        if listing is not None and any(isinstance(part, click.Argument) for part in listing.params):
            listing = None  # a word behind the noun would be taken for its argument
        alone = " Without a command, list them." if listing else ""
        examples = NOUNS[noun].replace("\n", "\n    ")
        super().__init__(
            noun,
            help=f"{COMMANDS[noun]}{alone}\n\n\b\nExample:\n    {examples}",
            params=listing.params if listing else [],
            callback=click.pass_context(self._alone) if listing else None,
            invoke_without_command=listing is not None,
        )

    def _alone(self, context: click.Context, /, **given: Any) -> None:
        if context.invoked_subcommand is None:
            listing = self.get_command_of("list")
            assert listing is not None and listing.callback is not None
            listing.callback(**given)

    def get_command_of(self, word: str) -> click.Command | None:
        """The command of an operation, or of one of its variants."""
        from .operation_command import command_of

        if word in self._operations:
            return command_of(operation(self._operations[word]), name=word)
        if "" not in self._operations:
            return None
        declared = operation(self._operations[""])
        variants = {str(kind.model_fields["method"].default): kind for kind in declared.variants}
        return command_of(declared, variants[word]) if word in variants else None

    def list_commands(self, ctx: click.Context) -> list[str]:
        words = {word for word in self._operations if word} | set(super().list_commands(ctx))
        if "" in self._operations:
            variants = operation(self._operations[""]).variants
            words |= {str(kind.model_fields["method"].default) for kind in variants}
        return sorted(words)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        return super().get_command(ctx, cmd_name) or self.get_command_of(cmd_name)
