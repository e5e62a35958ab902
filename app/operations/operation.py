"""An operation: what is asked, the function that answers, and what the answer is made of.

A request knows no door, and neither does a function: no click, no HTTP, no print. `app.doors` makes
the command, the JSON route, the form, the job and the Python method of each operation.
"""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Literal

from pydantic import BaseModel, ConfigDict, ValidationInfo, field_validator
from typing_extensions import TypeVar

from ...schema.person_roles import ADMINISTRATOR, OPERATOR, READER
from ..common.number_format import finite

if TYPE_CHECKING:
    from ...schema.person_roles import Person
    from ..figures.figure import Figure
    from .laboratory import Laboratory
    from .sentence import Sentence

#: Control characters but for tabs and line ends, and halves of surrogate pairs.
UNWRITABLE = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f\ud800-\udfff]")
#: Receives (steps done, all steps, what is being done).
Progress = Callable[[int, int, str], None]
Door = Literal["command", "json", "form", "python"]
DOORS: tuple[Door, ...] = ("command", "json", "form", "python")


class Request(BaseModel):
    """What is asked: fields with type, unit, bounds, default and one sentence of help.

    `operations.fields.request_field` makes a field. A request is made by `operations.faults.read`
    at a door, where faults are told by field.
    """

    model_config = ConfigDict(
        frozen=True, extra="forbid", allow_inf_nan=False, str_strip_whitespace=True
    )

    @field_validator("*", mode="before")
    @classmethod
    def _is_writable(cls, value: Any, info: ValidationInfo) -> Any:
        """Texts are stored, printed and looked up: every store and spreadsheet must take them. An
        empty text leaves out what need not be given."""
        if value == "" and cls.model_fields[str(info.field_name)].default is None:
            return None
        if isinstance(value, str) and (unwritable := UNWRITABLE.search(value)):
            raise ValueError(
                f"{info.field_name} has the character {unwritable[0]!r}, which cannot be written; "
                "leave it out"
            )
        return value


@dataclass(frozen=True)
class ResultTable:
    """Rows of a result. Keys are names of quantities with their SI unit at the end, or words.

    `empty` is what stands in the place of a table without rows. The command prints an `upright`
    table, which has few rows, with a line for each column.
    """

    title: str
    rows: Sequence[Mapping[str, Any]]
    empty: str = "none"
    upright: bool = False


@dataclass(frozen=True)
class Lines:
    """Sentences of a result under a heading of their own; left out where there are none."""

    title: str
    sentences: Sequence[Sentence | str]


class NotHereError(Exception):
    """This machine lacks what the work needs; another may have it. The message says what is
    missing."""


class NegativeAnswerError(ValueError):
    """The answer is no, and there is nothing to show: exit code 1 on the command line."""


class Result(ABC):
    """An answer. Its sentences, tables, figures and JSON are made from its fields, and from nothing
    else."""

    @property
    def exit_code(self) -> int:
        """1 where the answer to what was asked is "no"."""
        return 0

    def fault(self) -> str:
        """What of it could not be done, which is told last and makes the exit code 2; mostly
        empty."""
        return ""

    def notes(self) -> Sequence[str]:
        """Remarks beside the answer: what was assumed, and what was left out."""
        return ()

    def sentences(self) -> Sequence[Sentence]:
        """The answer in words."""
        return ()

    def tables(self) -> Sequence[ResultTable | Lines]:
        """The answer in rows, and what is said of its parts."""
        return ()

    def text(self) -> str:
        """The answer as it is printed in place of its tables, of one that is laid out already."""
        return ""

    def figures(self) -> Sequence[Figure]:
        """The answer in pictures."""
        return ()

    def write_figure(self, path: Path) -> None:
        """Draw the first of the pictures into a file.

        Parameters:
            path: The file, whose ending says its format: .png, .svg or .pdf.
        """
        from ..figures.matplotlib_renderer import write_figure

        write_figure(self.figures()[0], path)

    @abstractmethod
    def to_json(self) -> Any:
        """The answer for other programs: SI numbers, units in the keys."""

    def to_network_json(self) -> Any:
        """What the JSON route answers; mostly the same."""
        return self.to_json()

    def job_data(self) -> Any:
        """What a job keeps, from which the page of the answer is drawn."""
        return self.to_json()

    def stored_keys(self) -> Mapping[str, Any]:
        """Numbers under which the answer is stored: a job's result has them before its JSON."""
        return {}

    def address(self) -> str:
        """The page that shows the answer; empty where the page of its job does."""
        return ""

    def summary(self) -> str:
        """A few words for a list of jobs."""
        return ""

    def next_command(self) -> Sequence[str]:
        """Words of the command that usually follows; none where nothing does."""
        return ()

    def next_command_with(self, _others: Sequence[Any]) -> Sequence[str]:
        """The same after a command with several values, which had answers of the same kind, too."""
        return self.next_command()


@dataclass(frozen=True)
class Outcome(Result):
    """What was done: `lines` for people, `data` for programs, and the `page` that shows it."""

    lines: tuple[str, ...]
    data: Any
    page: str = ""

    def notes(self) -> Sequence[str]:
        """What was done."""
        return self.lines

    def to_json(self) -> Any:
        """The same for programs."""
        return self.data

    def address(self) -> str:
        """The page that shows it."""
        return self.page


@dataclass(frozen=True)
class PlainData(Result):
    """An answer for other programs alone, as plain data."""

    values: Any

    def to_json(self) -> Any:
        """The data; numbers that JSON has not (NaN) become null."""
        return finite(self.values)


@dataclass(frozen=True)
class Rows(Result):
    """The answer of a listing. On the command line its rows can be sorted, chosen by column and
    written as CSV."""

    rows: Sequence[Mapping[str, Any]]
    empty: str

    #: Its tables and its JSON are other ones than its rows, which stand for chosen columns.
    grouped: ClassVar[bool] = False

    def tables(self) -> Sequence[ResultTable]:
        """The one table."""
        return (ResultTable("", [self.shortened(row) for row in self.rows], self.empty),)

    def shortened(self, row: Mapping[str, Any]) -> dict[str, Any]:
        """A row as a table of limited width shows it."""
        return dict(row)

    def to_json(self) -> Any:
        """All rows with all their columns."""
        return [dict(row) for row in self.rows]


@dataclass(frozen=True, eq=False)
class Batches(Result):
    """Rows in batches of columns, of any number: the command writes them as they come, and every
    other door reads all of them. They can be read once."""

    #: Names of the columns, also of an answer without rows.
    columns: tuple[str, ...]
    batches: Iterator[dict[str, list[Any]]]

    @cached_property
    def rows(self) -> list[dict[str, Any]]:
        """All rows."""
        return [
            dict(zip(batch, row, strict=True))
            for batch in self.batches
            for row in zip(*batch.values(), strict=True)
        ]

    def tables(self) -> Sequence[ResultTable]:
        """The one table."""
        return (ResultTable("", self.rows, "no rows"),)

    def to_json(self) -> Any:
        """All rows with all their columns."""
        return self.rows


def same_fields(request: Request, other: type[Request]) -> dict[str, Any]:
    """The values of a request that another class of request takes, too."""
    names = other.model_fields.keys() & type(request).model_fields.keys()
    return {name: getattr(request, name) for name in names}


Asked = TypeVar("Asked", bound=Request)
Answer = TypeVar("Answer", bound=Result, default=Any)


@dataclass(frozen=True)
class Output(Generic[Answer]):
    """A file that a result can be written to: an option of the command, a link of a page.

    `in_place_of_tables`: whoever asks for the file does not read the tables as well. `check` raises
    for a file that cannot be written, before the work; `missing` says why an answer has nothing to
    write, and is empty where it has; `refused` says the same of a request, before the work. `older`
    is a spelling of the option that commands keep.
    """

    name: str
    help: str
    write: Callable[[Answer, Path], None]
    endings: tuple[str, ...] = ()
    in_place_of_tables: bool = False
    check: Callable[[Path], None] | None = None
    missing: Callable[[Answer], str] = lambda _: ""
    refused: Callable[[Any], str] = lambda _: ""
    older: str = ""
    #: The command does nothing else than to write it.
    required: bool = False


@dataclass(frozen=True)
class FormPage:
    """A page of its own with the form of an operation: its address, in which fields of the request
    may stand in braces, the id of the form, and the address that the form is sent to, in which
    fields may stand, too. `required` are fields that the form does not leave to their defaults.
    Without an id the address holds all values; without an action routes of the page itself
    answer."""

    page: str
    form: str
    action: str
    #: The form of the page that sends files of another machine in place of their path.
    upload: str = ""
    required: tuple[str, ...] = ()


def _label(request: Any) -> str:
    return str(getattr(request, "name", "") or getattr(request, "campaign", "") or "")


@dataclass(frozen=True)
class Operation(Generic[Asked, Answer]):
    """Something that a person asks of the software.

    `command`: its words on the command line ("plan", "lhs"); of an operation with `variants`, which
    are requests of one `method` each, every variant is a command below these words. `run` works and
    stores nothing that must not be stored twice; `keep`, where there is one, stores what `run` has
    made, in the transaction that ends a job. `absent`: door -> why it does not offer the operation.
    """

    name: str
    request: type[Asked]
    run: Callable[[Asked, Laboratory, Progress], Any]
    help: str
    example: str = ""
    keep: Callable[[Any, Laboratory], Answer] | None = None
    command: tuple[str, ...] = ()
    #: Method and address of the JSON route below /api; fields of the request may stand in it.
    route: tuple[Literal["GET", "POST"], str] | None = None
    #: Its route is GET, and takes the same request as the body of POST.
    also_posted: bool = False
    variants: Sequence[type[Asked]] = ()
    #: Its result is `Rows`.
    listing: bool = False
    #: Its result is `Batches`.
    streams: bool = False
    #: The listing that its command gives with `--list`, of the fields that both have.
    listed_by: str = ""
    #: Takes more than a second: a job at every door that cannot wait.
    long: bool = False
    #: What the steps of its progress are, such as "shots"; empty: it tells itself how far it is.
    steps: str = "steps"
    #: The role that a person needs who asks for it through a door that serves others; empty: by
    #: what it does (`needed_role`).
    role: str = ""
    #: Changes files, or the registry of models, and perhaps nothing in the store: it has its row of
    #: the audit trail all the same.
    changes_elsewhere: bool = False
    #: Leaves no row of the audit trail: it changes nothing that stays, or each piece of its work
    #: has rows of its own, as the jobs of a worker have.
    unrecorded: bool = False
    creates_store: bool = False
    #: Works without a store, too: an empty one stands for it, and is gone afterwards.
    needs_store: bool = True
    #: What a command works with where there is no store, of one that needs none; empty: nothing is
    #: said of it.
    without_store: str = ""
    #: Neither reads nor writes the store: the command takes `--db` and does nothing with it.
    uses_store: bool = True
    #: False: it opens the store at the address of the laboratory itself, or makes it.
    opens_store: bool = True
    #: Help of `--jobs` of an operation whose work `Laboratory.executor` does.
    workers: str = ""
    #: Help of `--jobs` of an operation that `Laboratory.processes` of this machine do.
    processes: str = ""
    #: Reads or writes files of the machine that it was asked on, to which its job is bound.
    on_this_machine: bool = False
    #: Writes texts into CSV, which a spreadsheet may take for formulas.
    writes_csv: bool = False
    #: Its answer is stored nowhere: the page that answers its form shows it.
    answered_here: bool = False
    #: Uploaded files stay after its job, for another operation.
    keeps_uploads: bool = False
    #: What is asked in its place where a request from the network has `dry_run`: an operation with
    #: the same fields, on whose page the work is asked for.
    rehearsal: Operation[Any, Any] | None = None
    #: The page of its job while it is worked on, with {job} for its number; empty: the usual one.
    job_page: str = ""
    #: What would be lost, of an operation that deletes: the command asks before, and takes `--yes`
    #: and `--dry-run`. Raises what would refuse the deletion.
    deletes: Callable[[Asked, Laboratory], str] | None = None
    outputs: Sequence[Output[Any]] = ()
    absent: Mapping[str, str] = field(default_factory=dict)
    #: Raises what would only be refused after the work; called before a job is queued.
    check: Callable[[Asked, Laboratory], None] | None = None
    #: What a list of jobs calls a request.
    label: Callable[[Any], str] = _label
    #: The page with its form; None: a page made from its fields, at /ask/NAME.
    form: FormPage | None = None
    #: The page that draws what a job keeps, with {job} for its number; empty: `Result.address`.
    result_page: str = ""

    @property
    def words(self) -> tuple[str, ...]:
        """The words of its command."""
        return self.command or (self.name,)

    @property
    def needed_role(self) -> str:
        """The role that a person needs: a reader reads, an administrator deletes, an operator does
        what is not said to be another's."""
        if self.role:
            return self.role
        if not self.changes:
            return READER
        return OPERATOR if self.deletes is None else ADMINISTRATOR

    @property
    def changes(self) -> bool:
        """Whether it can change something: its answer is kept, and it is asked for to be kept."""
        reads = self.listing or self.streams or self.answered_here or self.unrecorded
        return self.changes_elsewhere or not (reads or (self.route or ("",))[0] == "GET")

    def check_role(self, person: Person) -> None:
        """Refuse a person whose role may not ask for it.

        Raises:
            RoleNeededError: It names the role that is needed and who can give it.
        """
        person.check_may(self.needed_role, f"the operation {self.name}")

    def title(self, request: Asked) -> str:
        """What a list of jobs and a progress bar call a request: "Plan spring"."""
        return f"{' '.join(self.words).capitalize()} {self.label(request)}".strip()

    def answer(self, request: Asked, laboratory: Laboratory, progress: Progress) -> Answer:
        """The answer, with everything stored, and who asked for it; of a request with a field
        `dry_run` that is true, with nothing stored. Raises `RoleNeededError`."""
        from .change_record import recorded

        self.check_role(laboratory.person)
        if getattr(request, "dry_run", False):
            from ...schema.rehearsal import run_rehearsal

            with run_rehearsal(laboratory.store) as store:
                return self._answered(request, replace(laboratory, store=store), progress)
        with recorded(self, request, laboratory):
            return self._answered(request, laboratory, progress)

    def _answered(self, request: Asked, laboratory: Laboratory, progress: Progress) -> Answer:
        made = self.run(request, laboratory, progress)
        answer: Answer = made if self.keep is None else self.keep(made, laboratory)
        return answer

    def requests(self) -> Sequence[type[Asked]]:
        """The classes of request that it takes."""
        return tuple(self.variants) or (self.request,)
