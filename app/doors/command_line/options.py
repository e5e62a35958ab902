"""What options mean everywhere: lists by commas or by repeating the option, and what a deletion
asks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import wraps
from typing import Any, TypeVar

import click

Command = TypeVar("Command", bound=Callable[..., Any])


def split_names(_: click.Context, __: click.Parameter, texts: Sequence[str]) -> tuple[str, ...]:
    """A callback of an option of names that is repeated or holds a list: `--with a,b --with c`
    gives a, b and c."""
    return tuple(
        dict.fromkeys(name.strip() for text in texts for name in text.split(",") if name.strip())
    )


def deletion_options(command: Command) -> Command:
    """`--yes` and `--dry-run` of what the store deletes without keeping a reason; the command gets
    `dry_run`.

    `confirm_deletion` asks the person at the terminal, unless `--yes` is given.
    """

    @click.option("--yes", is_flag=True, help="Delete without asking for confirmation.")
    @click.option(
        "--dry-run", is_flag=True, help="Check whether it can be deleted, and delete nothing."
    )
    @wraps(command)
    def with_deletion(*args: Any, yes: bool, dry_run: bool, **others: Any) -> Any:
        context = click.get_current_context()
        context.meta["pyroshock.confirmed"] = yes or dry_run
        return command(*args, dry_run=dry_run, **others)

    return with_deletion  # type: ignore[return-value]  # click replaces its signature anyway


def confirm_deletion(what: str) -> None:
    """Ask whether to delete `what`. Raises `click.UsageError` where there is nobody to ask,
    `click.Abort` for a no."""
    import sys

    if click.get_current_context().meta["pyroshock.confirmed"]:
        return
    if not sys.stdin.isatty():
        raise click.UsageError(f"{what} would be deleted; add --yes to confirm the deletion")
    click.confirm(f"Delete {what}?", abort=True, err=True)
