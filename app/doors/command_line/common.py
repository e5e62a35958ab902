"""What every command shares: the store's address, the workers, how errors end, how tables are
printed, and the command as typed, without the secrets in it, which is stored with every row that
the command writes."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

import click

from ....files.spreadsheet_guard import guarding
from ....parallel.executor import BACKENDS, LOCAL, ExecutorConfig, usual_jobs
from ....schema.addresses import (
    HIDDEN,
    AddressError,
    address_for_display,
    parse_store_address,
    without_secrets,
)
from ...common.default_store import DEFAULT_DB
from ...common.number_format import format_number
from ...common.quantities import SYSTEMS, VARIABLE, System, display_of, shown_in

if TYPE_CHECKING:
    from ....schema.session import Store


Function = TypeVar("Function", bound=Callable[..., Any])

#: An error shows the value that it is about, which in a damaged file may be pages long.
LONGEST_LINE = 1000

#: What `--json` is when given without a file.
STDOUT = "-"


def db_option(function: Function) -> Function:
    """`--db URL`: the store."""
    return click.option(
        "--db",
        "db",
        metavar="URL",
        envvar="PYROSHOCK_DB",
        default=DEFAULT_DB,
        show_default=True,
        show_envvar=True,
        help="Use this store: the path of a file, sqlite:///FILE or "
        "postgresql+psycopg://USER@HOST/NAME.",
    )(function)


def json_option(function: Function) -> Function:
    """`--json [FILE]`: JSON on standard output and nothing else there, or into a file; `--units` of
    the tables else."""
    function = click.option(
        "--json",
        "json_to",
        is_flag=False,
        flag_value=STDOUT,
        default=None,
        metavar="[FILE]",
        help="Print JSON and nothing else on standard output, or write it to FILE.",
    )(function)
    return units_option(function)


def units_option(function: Function) -> Function:
    """`--units bench|si`: in which units tables and pictures show quantities; the command gets no
    argument of it."""
    return click.option(
        "--units",
        type=click.Choice(SYSTEMS),
        default=None,
        envvar=VARIABLE,
        show_envvar=True,
        expose_value=False,
        callback=_show_in,
        help="Show quantities in bar, g, kN, ms and mm (bench) or in SI units. [default: bench]",
    )(function)


def _show_in(ctx: click.Context, _: click.Parameter, system: System | None) -> None:
    if system is not None:
        ctx.with_resource(shown_in(system))


def spreadsheet_guard_option(function: Function) -> Function:
    """`--no-spreadsheet-guard`: CSV for programs; the command gets no argument of it."""
    return click.option(
        "--no-spreadsheet-guard",
        "guard",
        is_flag=True,
        flag_value=False,
        default=True,
        expose_value=False,
        callback=_guard_tables,
        help="Write texts in CSV as they are, for programs. [default: an "
        "apostrophe stands before = + - @]",
    )(function)


def _guard_tables(ctx: click.Context, _: click.Parameter, guard: bool) -> None:
    ctx.with_resource(guarding(guard))


def data_option(function: Function) -> Function:
    """`--data FOLDER`, repeated: where campaigns lie that the web application and its workers may
    read."""
    return click.option(
        "--data",
        "folders",
        multiple=True,
        type=click.Path(exists=True, file_okay=False, path_type=Path),
        help=(
            "Allow campaigns below this folder to be ingested by their path. The option can be "
            "repeated. [default: the current folder]"
        ),
    )(function)


class CommandGroup(click.Group):
    """A group whose help gives the whole first sentence of each command, where click cuts it to one
    line."""

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the section of commands."""
        commands = [(name, self.get_command(ctx, name)) for name in self.list_commands(ctx)]
        with formatter.section("Commands"):
            formatter.write_dl(
                [(name, command.get_short_help_str(1000)) for name, command in commands if command]
            )


@contextmanager
def errors_as_one_line() -> Iterator[None]:
    """Turn what a user can mend into one line on standard error and exit code 2."""
    try:
        yield
    except click.exceptions.Exit:
        raise
    except click.ClickException:
        raise
    except (KeyboardInterrupt, BrokenPipeError):
        raise
    except Exception as error:
        from ...common.errors import is_for_the_user, words_of

        if not is_for_the_user(error):
            raise
        # a refusal of several faults has a line for each; a library's message of several lines has
        # one
        several = len(getattr(error, "faults", ())) > 1
        fail(*(words_of(error).split("\n  ") if several else [words_of(error)]))


def fail(message: str, *below: str) -> None:
    """One line on standard error, further ones indented below, and exit code 2."""
    for start, text in (("pyroshock: ", message), *(("  ", text) for text in below)):
        line = " ".join(without_secrets(text).split())
        click.echo(
            start + (line if len(line) <= LONGEST_LINE else line[:LONGEST_LINE] + "…"), err=True
        )
    raise click.exceptions.Exit(2)


@contextmanager
def open_command_store(db: str, *, create: bool = False) -> Iterator[Store]:
    """The store at `db`; errors become one line. Nothing below sees a database error."""
    with errors_as_one_line():
        from ....schema.session import Writer, open_store

        with open_store(db, Writer(command_line(sys.argv), _version()), create=create) as store:
            yield store


@contextmanager
def open_for_dry_run(db: str) -> Iterator[Store]:
    """The store at `db` for a dry run; where there is none, an empty one that is gone
    afterwards."""
    with errors_as_one_line():
        from ....schema.rehearsal import open_for_rehearsal
        from ....schema.session import Writer

        with open_for_rehearsal(db, Writer(command_line(sys.argv), _version())) as store:
            yield store


@contextmanager
def without_store() -> Iterator[Store]:
    """No store, for work that never asks it: to make an empty one would take a second."""
    with errors_as_one_line():
        yield cast("Store", None)


def is_missing(db: str) -> bool:
    """Whether the file of a store is not there yet."""
    with errors_as_one_line():
        try:
            url = parse_store_address(db)
        except AddressError:  # `open_command_store` says what is wrong with it
            return False
    return url.drivername.startswith("sqlite") and not Path(url.database or "").exists()


def _version() -> str:
    from .... import __version__

    return __version__


def write_json(data: Any, json_to: str) -> None:
    """JSON to standard output or a file; numbers that JSON has not (NaN) become null."""
    if isinstance(data, Iterator):
        data = list(data)
    text = json.dumps(data, indent=2, allow_nan=False, default=str)
    if json_to == STDOUT:
        click.echo(text)
    else:
        with errors_as_one_line():
            from ....files.atomic_write import write_text

            write_text(Path(json_to), text + "\n")
        click.echo(f"written: {json_to}", err=True)


def print_table(rows: Iterable[dict[str, Any]], empty: str, *, upright: bool = False) -> None:
    """Rows as aligned text; the header is the first row's keys, extended by later ones'.

    A key is headed by its words, and with a unit at its end (`peak_force_n`) by the unit that is
    shown; its numbers are in that unit. `upright`: a line for each column, the rows beside each
    other.
    """
    rows = list(rows)
    if not rows:
        click.echo(empty)
        return
    displays = {key: display_of(key) for row in rows for key in row}
    cells = [
        {key: format_cell(value, displays[key].scale) for key, value in row.items()} for row in rows
    ]
    headings = {
        key: display.heading if display.unit or upright else _spelled(key)
        for key, display in displays.items()
    }
    widths = {
        key: max(len(head), *(len(row.get(key, "")) for row in cells))
        for key, head in headings.items()
    }
    if upright:
        _print_upright(headings, cells)
        return
    click.echo("  ".join(head.ljust(widths[key]) for key, head in headings.items()).rstrip())
    for row in cells:
        click.echo("  ".join(row.get(key, "").ljust(widths[key]) for key in headings).rstrip())


def _spelled(key: str) -> str:
    """`plate_material` -> `plate material`; words with the name of a channel in them stay."""
    return key.replace("_", " ") if key.isidentifier() else key


def _print_upright(headings: Mapping[str, str], rows: Sequence[Mapping[str, str]]) -> None:
    """A line for each column, the rows beside each other: few rows of many columns would not fit a
    terminal."""
    lines = [[head, *(row.get(key, "") for row in rows)] for key, head in headings.items()]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    for line in lines:
        click.echo(
            "  ".join(text.ljust(width) for text, width in zip(line, widths, strict=True)).rstrip()
        )


def format_cell(value: Any, scale: float = 1.0) -> str:
    """A value for a person; a number in the unit of which the SI unit has `scale`."""
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return format_number(value * scale)
    return str(value)


def note(message: str) -> None:
    """A remark on standard error, out of the way of what is piped."""
    click.echo(message, err=True)


#: Options whose value is a secret whatever it looks like (a test finds those that are missing
#: here).
SECRET_OPTIONS = frozenset({"--token"})
#: Options whose value is an address.
_ADDRESSES = frozenset({"--db", "--mlflow", "--scheduler"})


def read_secret(name: str) -> str:
    """A word that no list of processes and no history may show: typed twice at a terminal, else the
    first line of standard input.

    Parameters:
        name: What the prompt calls it.
    """
    if sys.stdin.isatty():
        return str(click.prompt(name.capitalize(), hide_input=True, confirmation_prompt=True))
    return sys.stdin.readline().rstrip("\r\n")


def command_line(arguments: Sequence[str]) -> str:
    """`arguments` as of `sys.argv`, in one line."""
    program = Path(arguments[0]).name
    before, words = (
        "",
        ["pyroshock" if program == "__main__.py" else program],
    )  # as `python -m pyroshock` calls it
    for word in arguments[1:]:
        words.append(_hide_secret(word, before))
        before = word
    return " ".join(words)


def _hide_secret(word: str, before: str) -> str:
    option, equals, value = word.partition("=")
    if before in SECRET_OPTIONS:
        return HIDDEN
    if equals and option in SECRET_OPTIONS:
        return f"{option}={HIDDEN}"
    if equals and option in _ADDRESSES:
        return f"{option}={address_for_display(value)}"
    return (
        address_for_display(word)
        if before in _ADDRESSES or "://" in word
        else without_secrets(word)
    )


Command = Callable[..., Any]


def jobs_option(jobs_help: str) -> Callable[[Command], Command]:
    """`--jobs N`, the same of every command: None where neither the option nor PYROSHOCK_JOBS says
    how many."""
    return click.option(
        "--jobs",
        type=click.IntRange(1),
        default=None,
        metavar="N",
        envvar="PYROSHOCK_JOBS",
        show_envvar=True,
        help=f"{jobs_help} [default: the number of cores, at most 4]",
    )


def worker_options(jobs_help: str) -> Callable[[Command], Command]:
    """The command gets one argument `executor`, of a cluster that answers."""

    def decorated(command: Command) -> Command:
        @jobs_option(jobs_help)
        @click.option(
            "--backend",
            type=click.Choice(BACKENDS),
            default=LOCAL,
            show_default=True,
            help="Choose where the work is done: on this machine or on a cluster. "
            "The results are the same.",
        )
        @click.option(
            "--scheduler",
            default=None,
            metavar="ADDRESS",
            help="Give the address of the cluster's scheduler, such as tcp://HOST:8786.",
        )
        @wraps(command)
        def with_workers(
            *args: Any, jobs: int | None, backend: str, scheduler: str | None, **others: Any
        ) -> Any:
            with errors_as_one_line():
                executor = ExecutorConfig(backend, jobs or usual_jobs(), scheduler)
                executor.check()
            return command(*args, executor=executor, **others)

        return with_workers

    return decorated
