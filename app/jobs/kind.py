"""What a kind of job is: a name, arguments that any process can read, a function, and what is
tidied up after it; what the function is given, and what it gives back."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any, Generic, TypeVar

from pydantic import BaseModel

from .lease import FencedStore

#: Told (done, total, what); raises `StoppedError` or another end of the attempt.
Step = Callable[[int, int, str], None]


class StoppedError(Exception):
    """A person has stopped the job."""


class InterruptedWorkError(Exception):
    """The worker is told to end: the job goes back to the queue."""


@dataclass(frozen=True)
class JobResult:
    """Where to see what a job did (an address of a page), what to say of it, and it as plain data
    for scripts; `whole` is the result for `operations.result_codec.decode`."""

    address: str
    words: str = ""
    data: Any = None
    whole: Any = None


#: Writes what must not be written twice, and tells the result: called within the transaction that
#: ends the job, and again where that was rolled back.
Ending = Callable[[], JobResult]


@dataclass(frozen=True)
class RunningJob:
    """A job in hand: its number, the store that it may write while it is this worker's, and how to
    tell progress.

    `db` is the store's address, beside which models and plates are kept; `folders` those that may
    be read from.
    """

    job: int
    store: FencedStore
    db: str
    step: Step
    folders: tuple[Path, ...] = ()


Arguments = TypeVar("Arguments")


def _nothing(_: Any) -> None:
    pass


@dataclass(frozen=True)
class JobForm:
    """The page whose form asks for such a job. `fields` are the values that `forms.js` writes into
    the controls of the form with the id `form`; without them the address holds all that there is to
    fill in."""

    address: str
    form: str = ""
    fields: Mapping[str, str | list[str]] = field(default_factory=dict)


def _no_form(_: Any) -> JobForm | None:
    return None


@dataclass(frozen=True)
class Kind(Generic[Arguments]):
    """`record` is a frozen dataclass of plain values, or the request of an operation; `do` may be
    begun again by another process, whatever ended it.

    So what `do` stores is either found again by its natural key, or written by the `Ending` that it
    returns. `after` is called on the machine that a job was bound to, once it is over, perhaps
    twice.
    """

    name: str
    record: type[Arguments]
    do: Callable[[RunningJob, Arguments], Ending]
    after: Callable[[Arguments], None] = _nothing
    #: The form that asks for such a job; None where no page has one.
    form: Callable[[Arguments], JobForm | None] = _no_form
    #: Reads the arguments of a stored job, of a record that is a request of an operation.
    read_stored: Callable[[Mapping[str, Any]], Arguments] | None = None

    def read(self, stored: Mapping[str, Any]) -> Arguments:
        """The arguments of a stored job. Raises `ValueError` for one that another version asked
        for."""
        if self.read_stored is not None:
            return self.read_stored(stored)
        try:
            return self.record(**stored)
        except TypeError as error:
            # a dataclass
            field_names = ", ".join(item.name for item in fields(self.record))  # type: ignore[arg-type]
            was = f"a job of kind {self.name} with {', '.join(stored)}"
            raise ValueError(
                f"{was}; this software knows {field_names}: ask for it anew"
            ) from error

    def plain(self, arguments: Arguments) -> dict[str, Any]:
        """The inverse of `read`."""
        if isinstance(arguments, BaseModel):
            return arguments.model_dump(mode="json")
        return asdict(arguments)  # type: ignore[call-overload, no-any-return]  # a dataclass
