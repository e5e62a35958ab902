"""The kinds of error that the library raises, each with the words that the command line prints.

Whatever a user can mend is a `PyroshockError`. Each is also the built-in error that a Python user
expects, so that `except ValueError` works as well. Anything else that comes out of the library is a
fault of the software.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from typing import ParamSpec, TypeVar

from sqlalchemy.exc import SQLAlchemyError

from ...schema.engine import MAKE_ROOM, StoreError, disk_is_full

Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")


class PyroshockError(Exception):
    """Something that the user can mend; the message names the thing, its value and the next
    step."""


class InvalidValueError(PyroshockError, ValueError):
    """A value, a unit, a file or a combination of arguments that cannot be used."""


class NotFoundError(PyroshockError, LookupError):
    """A campaign, an impact, a plan, a dataset, a model or a column that does not exist."""

    def __str__(self) -> str:
        return str(self.args[0]) if self.args else ""  # a LookupError may quote its message


class StorageError(PyroshockError, OSError):
    """The store, a file or a server cannot be read or written."""


#: An option of the command line, or a whole command, whose options stay as they are.
_OPTION = re.compile(r"pyroshock [a-z][^;)]*|(?<![\w-])--([a-z]+(?:-[a-z]+)*)")
#: Options whose argument has another name.
_ARGUMENTS = {
    "effect": "effects",
    "impact-at": "impact_points",
    "no-adopted": "adopted=False",
    "sensor-at": "sensors",
    "with": "with_effects",
    "without": "without_effects",
}


def argument_names(text: str) -> str:
    """A message with options of the command line called as arguments: `--tank-pressure` is
    `tank_pressure`.

    Parameters:
        text: The message; whole commands in it ("pyroshock plan lhs --runs 12") stay as they are.
    """

    def argument(match: re.Match[str]) -> str:
        option = match[1]
        return match[0] if option is None else _ARGUMENTS.get(option, option.replace("-", "_"))

    return _OPTION.sub(argument, text)


@contextmanager
def library_errors() -> Iterator[None]:
    """Raise what a user can mend as one of the kinds above; other errors pass unchanged."""
    try:
        yield
    except PyroshockError:
        raise
    except Exception as error:
        if not is_for_the_user(error):
            raise
        kinds = ((LookupError, NotFoundError), (ValueError, InvalidValueError))
        kind = next((ours for builtin, ours in kinds if isinstance(error, builtin)), StorageError)
        raise kind(argument_names(words_of(error))) from error


def raises_library_errors(function: Callable[Parameters, Result]) -> Callable[Parameters, Result]:
    """A function of the public interface, whose errors are of the kinds above.

    Parameters:
        function: The function, which may raise any error.
    """

    @wraps(function)
    def wrapped(*args: Parameters.args, **kwargs: Parameters.kwargs) -> Result:
        with library_errors():
            return function(*args, **kwargs)

    return wrapped


def is_for_the_user(error: Exception) -> bool:
    """Whether the words of an error help who asked; a bug of ours does not.

    Parameters:
        error: The error as it was raised.
    """
    # ValueError and LookupError are how our libraries refuse an argument; a bug of ours shows its
    # traceback.
    if type(error) in (ValueError, LookupError) or isinstance(
        error, StoreError | OSError | SQLAlchemyError
    ):
        return True
    return isinstance(error, ValueError | LookupError) and type(error).__module__.startswith(
        "pyroshock"
    )


def words_of(error: Exception) -> str:
    """What to tell of it.

    Parameters:
        error: The error; of a full disk, the words say how to make room.
    """
    message = str(error)
    return (
        f"{message}; {MAKE_ROOM}" if disk_is_full(error) and "make room" not in message else message
    )
