"""`query`: a question in SQL, which cannot change anything."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import chain
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, ValidationInfo, model_validator

from ....schema.person_roles import ADMINISTRATOR, ENGINEER
from ..fields import Presentation, quantity, request_field, row_limit, source_of
from ..laboratory import Laboratory
from ..operation import Batches, Operation, Progress, Request

#: Over a network an answer has no more rows than these, and takes no longer.
USUAL_ROWS, MOST_ROWS, LONGEST_S = 10_000, 100_000, 60.0


def _values(texts: Any) -> Any:
    """NAME=VALUE in each line as a mapping; values as text."""
    if texts is None or texts == "":
        return {}
    if isinstance(texts, str):
        texts = [line.partition("=")[::2] for line in texts.splitlines() if line.strip()]
    pairs = texts.items() if isinstance(texts, Mapping) else texts
    try:
        return {str(name).strip(): str(value) for name, value in pairs}
    except TypeError as error:
        raise ValueError(f"parameters is {texts!r:.200}; expected names with values") from error


def _bounded(seconds: float, info: ValidationInfo) -> float:
    if not seconds > 0:
        raise ValueError(f"timeout is {seconds:g} s; expected more than 0s")
    if source_of(info) == "network" and seconds > LONGEST_S:
        raise ValueError(
            f"timeout is {seconds:g} s; expected at most {LONGEST_S:g}s over a network"
        )
    return seconds


class StoreQuestion(Request):
    """A statement, or what tables and columns there are."""

    statement: str | None = request_field(
        None,
        max_length=100_000,
        help="Answer this SELECT statement.",
        presentation=Presentation(positional=True, lines=6),
    )
    parameters: Annotated[dict[str, str], BeforeValidator(_values)] = request_field(
        {},
        help="Give the value of :NAME in the statement. It is bound, never pasted. "
        "The option can be repeated.",
        presentation=Presentation(metavar="NAME VALUE", option="parameter", pair=True, lines=3),
    )
    limit: row_limit(USUAL_ROWS, MOST_ROWS) = request_field(  # type: ignore[valid-type]
        None,
        validate_default=True,
        help=f"List at most this number of rows. [default: all, over a network {USUAL_ROWS}]",
    )
    timeout: Annotated[quantity("s"), AfterValidator(_bounded)] = request_field(  # type: ignore[valid-type]
        LONGEST_S,
        help="Stop a statement that takes longer than this number of seconds. [default: 60s]",
        example="60s",
        presentation=Presentation(metavar="SECONDS"),
    )
    tables: bool = request_field(False, help="List the tables.")
    columns_of: str | None = request_field(
        None,
        max_length=1000,
        help="List the columns of a table, with units.",
        presentation=Presentation(metavar="TABLE", option="schema"),
    )

    @model_validator(mode="after")
    def _asks_once(self) -> StoreQuestion:
        count = (self.statement is not None) + self.tables + (self.columns_of is not None)
        if count != 1:
            raise ValueError(
                f"{'' if count else 'the statement is empty; '}give one statement "
                '("select ..."), --tables, or --schema TABLE'
            )
        return self


def _ask(request: StoreQuestion, laboratory: Laboratory, _: Progress) -> Batches:
    from .query import list_columns, list_tables

    if request.statement is None:
        rows = list_tables() if request.tables else list_columns(str(request.columns_of))
        columns = {name: [row[name] for row in rows] for name in rows[0]}
        return Batches(tuple(columns), iter([columns]))
    batches = _answered(request, request.statement, laboratory)
    first = next(batches)  # a statement that cannot be run is refused here
    whole = chain([first], batches)
    return Batches(
        tuple(first), whole if request.limit is None else _first_rows(whole, request.limit)
    )


def _answered(
    request: StoreQuestion, sql: str, laboratory: Laboratory
) -> Iterator[dict[str, list[Any]]]:
    from ....schema.users import SECRET_TABLES
    from .query import Statement, run_statement

    statement, person = Statement(sql, request.parameters), laboratory.person
    hidden = [
        *SECRET_TABLES,
        *([] if person.may(ADMINISTRATOR) else ["users", "sign_on_identities"]),
        *([] if person.may(ENGINEER) else ["audit_rows"]),
    ]
    with run_statement(laboratory.store.engine, statement, request.timeout, hidden) as batches:
        yield from batches


def _first_rows(
    batches: Iterator[dict[str, list[Any]]], limit: int
) -> Iterator[dict[str, list[Any]]]:
    remaining = limit
    for batch in batches:
        yield {name: values[:remaining] for name, values in batch.items()}
        remaining -= len(next(iter(batch.values())))
        if remaining <= 0:
            return


QUERY: Operation[StoreQuestion, Batches] = Operation(
    name="query",
    request=StoreQuestion,
    run=_ask,
    help="""Answer one SELECT statement in SQL from the store; it cannot change anything. Numbers
are in SI units, with the unit in the name of the column.""",
    example='pyroshock query "select name, kind from campaigns"\n'
    'pyroshock query "select * from pulses where peak_force_n > :force" -p force 2000 --csv\n'
    "pyroshock query --tables\npyroshock query --schema pulses",
    streams=True,
    answered_here=True,
)
