"""The command of an operation: options from the fields of its request, output from its result."""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args, get_origin

import click
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from ....parallel.executor import ExecutorConfig
from ...common.progress import progress_bar
from ...common.quantities import velocities_of
from ...operations.catalogue import operation as operation_named
from ...operations.faults import RequestError, bare, read, spelled_as
from ...operations.fields import presentation_of
from ...operations.laboratory import Laboratory
from ...operations.operation import (
    Lines,
    NegativeAnswerError,
    Operation,
    Output,
    Progress,
    Request,
    Result,
    ResultTable,
)
from . import completion
from .common import (
    STDOUT,
    db_option,
    errors_as_one_line,
    fail,
    is_missing,
    jobs_option,
    json_option,
    note,
    open_command_store,
    open_for_dry_run,
    print_table,
    read_secret,
    spreadsheet_guard_option,
    without_store,
    worker_options,
    write_json,
)
from .listed import Listing, listing_options
from .next_step import suggest_next
from .options import confirm_deletion, deletion_options
from .streamed import Stream, stream_options

if TYPE_CHECKING:
    from ....schema.session import Store

_OUTPUT = "output_"
#: Fields that a door knows from the operation itself.
_HIDDEN = ("method",)


def command_of(
    operation: Operation[Any, Any], request: type[Request] | None = None, name: str = ""
) -> click.Command:
    """The command of an operation, or of the variant of it that `request` is; `name` is its last
    word where it has several."""
    typed_request = request or operation.request
    several = next(
        (
            name
            for name, field in typed_request.model_fields.items()
            if presentation_of(field).several
        ),
        None,
    )

    def call(json_to: str | None = None, db: str = "", listed: bool = False, **given: Any) -> None:
        if listed:
            listing_of = operation_named(operation.listed_by)
            names = listing_of.request.model_fields
            shared = {name: value for name, value in _stated(given).items() if name in names}
            _perform(
                listing_of, listing_of.request, [shared], _Work(db), {}, None, Listing(json_to)
            )
            return
        files = {}
        for output in operation.outputs:
            paths = [given.pop(_OUTPUT + spelled, None) for spelled in (output.name, output.older)]
            if any(paths):
                files[output] = next(filter(None, paths))
        for output in operation.outputs:
            if output.required and output not in files:
                fail(f"--{output.name} is missing; expected the path of a file")
        work = _Work(
            db,
            given.pop("executor", None),
            given.pop("jobs", None) if operation.processes else None,
            given.pop("dry_run", False) if operation.deletes is not None else False,
        )
        listing = given.pop("listing", None)
        values = _stated(given)
        for field_name, field in typed_request.model_fields.items():
            if presentation_of(field).secret:
                values[field_name] = read_secret(field_name)
        if several is not None:
            json_to = _given_back(json_to, values, several)
        every = [values]
        if several is not None and values.get(several):
            every = [{**values, several: value} for value in values[several]]
        _perform(operation, typed_request, every, work, files, json_to, listing)

    function: Any = db_option(call) if operation.uses_store else _unused_db(call)
    if operation.streams:
        function = stream_options(function)
    else:
        function = listing_options(function) if operation.listing else json_option(function)
    if operation.listed_by:
        text = "List those that the store holds, and do nothing else."
        function = click.option("--list", "listed", is_flag=True, help=text)(function)
    if operation.deletes is not None:
        function = deletion_options(function)
    if operation.workers:
        function = worker_options(operation.workers)(function)
    if operation.processes:
        function = jobs_option(operation.processes)(function)
    if operation.writes_csv or any(".csv" in output.endings for output in operation.outputs):
        function = spreadsheet_guard_option(function)
    for output in reversed(operation.outputs):
        function = _output_option(output)(function)
    for field_name, field in reversed(typed_request.model_fields.items()):
        if field_name not in _HIDDEN and not presentation_of(field).secret:
            function = parameter(field_name, field)(function)
    word = name or _words(operation, typed_request)[-1]
    return click.command(word, cls=OperationCommand, help=_help(operation, typed_request))(function)


class OperationCommand(click.Command):
    """Options whose field says `words` take all words behind them: `--from A B C` is
    `--from A --from B --from C`."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        greedy = {
            spelled
            for option in self.params
            if isinstance(option, click.Option) and getattr(option, "takes_words", False)
            for spelled in option.opts
        }
        typed: list[str] = []
        taking = ""
        for word in args:
            if word.startswith("-"):
                taking = spelled if (spelled := word.split("=")[0]) in greedy else ""
            elif taking and typed[-1] != taking:
                typed.append(taking)
            typed.append(word)
        return super().parse_args(ctx, typed)


class _Option(click.Option):
    """An option that may take all words behind it."""

    def __init__(self, *args: Any, takes_words: bool = False, **words: Any) -> None:
        super().__init__(*args, **words)
        self.takes_words = takes_words


def _words(operation: Operation[Any, Any], request: type[Request]) -> tuple[str, ...]:
    if not operation.variants:
        return operation.words
    return (*operation.words, str(request.model_fields["method"].default))


def _help(operation: Operation[Any, Any], request: type[Request]) -> str:
    variant = bool(operation.variants)
    text = (request.__doc__ or "") if variant else operation.help
    paragraphs = text.strip().replace("\n    ", "\n")
    example = str(getattr(request, "example_command", "")) if variant else operation.example
    lines = "".join(f"\n    {line}" for line in example.splitlines())
    return f"{paragraphs}\n\n\b\nExample:{lines}" if lines else paragraphs


def _unused_db(function: Callable[..., Any]) -> Callable[..., Any]:
    return click.option(
        "--db",
        hidden=True,
        expose_value=False,
        help="This option is accepted as everywhere; nothing is read from the store.",
    )(function)


def _given_back(json_to: str | None, values: dict[str, Any], several: str) -> str | None:
    """Where the JSON goes: behind `--json` may stand the first of several folders, which then is
    the first value of the field."""
    if json_to is None or json_to == STDOUT or not Path(json_to).is_dir():
        return json_to
    values[several] = (json_to, *values.get(several, ()))
    return STDOUT


def _stated(given: Mapping[str, Any]) -> dict[str, Any]:
    """What was typed: neither options that were left out nor empty repetitions."""
    return {name: value for name, value in given.items() if value not in (None, ())}


# --- options


def option_of(name: str, field: FieldInfo) -> str:
    """`--tank-pressure` of `tank_pressure`; `--no-adopted` of what is true unless it is refused."""
    spelled = (presentation_of(field).option or name).replace("_", "-")
    negated = bare(field.annotation) is bool and field.default is True
    return f"--no-{spelled}" if negated else f"--{spelled}"


def parameter(name: str, field: FieldInfo) -> Callable[[Any], Any]:
    """The argument or option of a field. Its value is a text, which the request reads."""
    shown, kind = presentation_of(field), bare(field.annotation)
    complete = getattr(completion, shown.completion) if shown.completion else None
    if shown.positional:
        return click.argument(
            name,
            required=field.is_required() and not shown.several,
            nargs=-1 if _is_repeated(kind) or shown.several else 1,
            metavar=shown.metavar or None,
            shell_complete=complete,
        )
    option = option_of(name, field)
    if kind is bool:
        negated = option.startswith("--no-")
        flag: dict[str, Any] = {"is_flag": True, "default": None}
        decorate = click.option(
            option, name, flag_value=not negated, help=field.description, **flag
        )
        if not negated:
            return decorate
        # whoever states the default is understood
        stated = click.option(f"--{option[5:]}", name, flag_value=True, hidden=True, **flag)
        return lambda function: decorate(stated(function))
    words: dict[str, Any] = {
        "help": _with_default(field),
        "required": False,
        "metavar": shown.metavar or _metavar(kind, shown.unit),
        "multiple": _is_repeated(kind),
        "shell_complete": complete or _choices(kind),
        "type": click.UNPROCESSED if _is_repeated(kind) else str,
    }
    if shown.pair:
        words |= {"nargs": 2, "type": str}
        return click.option(option[1:3], option, name, **words)
    return click.option(option, name, cls=_Option, takes_words=shown.words, **words)


def _is_repeated(kind: Any) -> bool:
    return get_origin(kind) in (tuple, list, dict)


def _choices(kind: Any) -> Any:
    if get_origin(kind) is not Literal:
        return None
    texts = [str(choice) for choice in get_args(kind)]
    return lambda _context, _parameter, begun: [text for text in texts if text.startswith(begun)]


def _metavar(kind: Any, unit: str) -> str | None:
    if get_origin(kind) is Literal:
        return f"[{'|'.join(map(str, get_args(kind)))}]"
    if kind is int:
        return "INTEGER"
    if kind is float:
        return f"NUMBER {unit}".strip() if unit else "NUMBER"
    return None


def _with_default(field: FieldInfo) -> str:
    """The help of an option; its default where a person would not guess it."""
    text = field.description or ""
    default = field.default
    if field.is_required():
        return f"{text} The option is required."
    if default is PydanticUndefined or default in (None, "", (), {}) or "[default:" in text:
        return text
    return f"{text} [default: {default}]"


def _output_option(output: Output[Any]) -> Callable[[Any], Any]:
    ending = "|FILE".join(output.endings)
    required = " The option is required." if output.required else ""
    path = click.Path(path_type=Path, dir_okay=False)

    def decorated(function: Any) -> Any:
        if output.older:
            older = f"{_OUTPUT}{output.older}"
            function = click.option(f"--{output.older}", older, type=path, hidden=True)(function)
        return click.option(
            f"--{output.name}",
            f"{_OUTPUT}{output.name}",
            type=path,
            metavar=f"FILE{ending}" if ending else "FILE",
            help=f"{output.help}{required}",
        )(function)

    return decorated


# --- the work


@dataclass(frozen=True)
class _Work:
    """Where a command works: the store, the processes, and whether a deletion is only tried."""

    db: str
    executor: ExecutorConfig | None = None
    processes: int | None = None
    dry_run: bool = False

    def laboratory(self, store: Store) -> Laboratory:
        """The laboratory of the command."""
        executor = self.executor or ExecutorConfig()
        return Laboratory(store, self.db, executor, processes=self.processes, tell=note)


def _perform(
    operation: Operation[Any, Any],
    request: type[Request],
    every: Sequence[Mapping[str, Any]],
    work: _Work,
    files: Mapping[Output[Any], Path],
    json_to: str | None,
    listing: Listing | Stream | None,
) -> None:
    with errors_as_one_line(), _faults_as_options(request):
        # before the store is opened and anything heavy is imported
        requests = [read(request, values, "command") for values in every]
        for output, path in files.items():
            for refusal in filter(None, map(output.refused, requests)):
                fail(refusal)
            if output.check is not None:
                output.check(path)
    results: list[Result] = []
    progress = _progress(operation, requests[0])
    rehearsed = getattr(requests[0], "dry_run", False)
    with _opened(operation, work.db, rehearsed=rehearsed) as store:
        gc.enable()  # `LazyGroup.main` had disabled it
        for number, command_request in enumerate(requests):
            if number:
                progress = _progress(operation, command_request)
            result: Any = _answer(operation, command_request, work, store, progress)
            if result is None:
                return
            results.append(result)
            if listing is None:
                _tell(result, files, json_to)
            elif isinstance(listing, Listing) and result.grouped and not listing.is_by_row:
                _tell(result, {}, listing.json_to)
                if listing.json_to is not None:
                    write_json(result.to_json(), listing.json_to)
            else:
                listing.show_answer(result)
        if json_to is not None and listing is None:
            answers = [result.to_json() for result in results]
            write_json(answers[0] if len(answers) == 1 else answers, json_to)
    first, *others = results
    if words := first.next_command_with(others):
        suggest_next(*words)
    for fault in filter(None, (result.fault() for result in results)):
        fail(fault)
    if code := max(result.exit_code for result in results):
        raise click.exceptions.Exit(code)


def _progress(operation: Operation[Any, Any], request: Request) -> AbstractContextManager[Progress]:
    if operation.steps:
        return progress_bar(operation.title(request), operation.steps)
    return nullcontext(lambda _done, _total, _what: None)


def _answer(
    operation: Operation[Any, Any],
    request: Request,
    work: _Work,
    store: Store,
    progress: AbstractContextManager[Progress],
) -> Result | None:
    """The answer; None where only a deletion was tried."""
    laboratory = work.laboratory(store)
    if operation.check is not None:
        with _faults_as_options(type(request)):
            operation.check(request, laboratory)
    if operation.deletes is not None:
        lost = operation.deletes(request, laboratory)
        if work.dry_run:
            note(f"{lost} can be deleted; nothing was deleted")
            return None
        confirm_deletion(lost)
    try:
        with progress as step:
            result: Result = operation.answer(request, laboratory, step)
    except NegativeAnswerError as error:
        note(str(error))
        raise click.exceptions.Exit(1) from error
    return result


def _opened(
    operation: Operation[Any, Any], db: str, *, rehearsed: bool
) -> AbstractContextManager[Store]:
    if not (operation.uses_store and operation.opens_store):
        return without_store()
    if operation.needs_store and not (rehearsed and operation.creates_store):
        return open_command_store(db, create=operation.creates_store)
    if operation.without_store and is_missing(db):
        note(f"no store at {db}: {operation.without_store}")
    return open_for_dry_run(db)


def _tell(result: Result, files: Mapping[Output[Any], Path], json_to: str | None) -> None:
    for line in result.notes():
        note(line)
    for output, path in files.items():
        if missing := output.missing(result):
            note(f"not written: {path}: {missing}")
            continue
        output.write(result, path)
        note(f"written: {path}")
    sentences = [sentence.text for sentence in result.sentences()]
    if json_to is not None:
        for text in sentences:
            note(text)
        return
    for text in sentences:
        click.echo(text)
    if any(output.in_place_of_tables for output in files):
        return
    if text := result.text():
        click.echo(text)
        return
    tables = result.tables()
    rows = [row for table in tables if isinstance(table, ResultTable) for row in table.rows]
    with velocities_of(rows):
        _tell_tables(tables, bool(sentences))


def _tell_tables(tables: Sequence[ResultTable | Lines], below_sentences: bool) -> None:
    below_facts = False
    for table in tables:
        if isinstance(table, Lines):
            _tell_lines(table)
            continue
        if below_facts:
            click.echo("")
        if table.title:
            click.echo(f"\n{table.title}" if below_sentences else table.title)
        print_table(map(dict, table.rows), table.empty, upright=table.upright)
        below_facts = below_facts or table.upright


def _tell_lines(lines: Lines) -> None:
    if lines.sentences:
        click.echo(f"\n{lines.title}")
    for line in lines.sentences:
        click.echo(f"  {line}")


@contextmanager
def _faults_as_options(request: type[Request]) -> Iterator[None]:
    """Faults of a request with the options that they are about."""
    try:
        yield
    except RequestError as error:
        fail(*(spelled_as(fault, request, _spelled) for fault in error.faults))


def _spelled(name: str, field: FieldInfo) -> str:
    return name if presentation_of(field).positional else option_of(name, field)
