"""What is fuzzed: a way into the product, files that it takes, how these are damaged, and what is a
finding."""

from __future__ import annotations

import shutil
import traceback
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from random import Random

#: A damaged copy of an input; the others of its target lend pieces.
Mutate = Callable[[bytes, Random, Sequence[bytes]], bytes]
#: Gives an input to the product, in an empty folder: "accepted" or "set aside", else it raises.
Use = Callable[[bytes, Path], str]

ACCEPTED, REFUSED, SET_ASIDE = "accepted", "refused", "set aside"


@dataclass(frozen=True)
class Target:
    """`refusals` are the errors by which the product may refuse; their message must hold `names`,
    one line of text.

    `watched` are the source files whose lines the long run counts.
    """

    name: str
    use: Use
    seeds: Callable[[], Sequence[bytes]]
    mutate: Mutate
    refusals: tuple[type[Exception], ...]
    names: str
    watched: tuple[str, ...]
    #: Its share of a long run: whole campaigns take a hundred times as long as a table.
    weight: float = 1.0
    #: A library of it may be crashed by a damaged file: the ingest reads such files in a process of
    #: their own.
    may_crash: bool = False


def stacked(mutations: Mapping[Mutate, int], most: int = 4) -> Mutate:
    """One of the mutations, sometimes two or `most`, drawn by their weights, one after the
    other."""
    choices, weights = list(mutations), list(mutations.values())

    def mutate(data: bytes, rng: Random, others: Sequence[bytes]) -> bytes:
        for _ in range(rng.choice((1, 1, 1, 2, most))):
            (one,) = rng.choices(choices, weights)
            data = one(data, rng, others)
        return data

    return mutate


FINDING = "finding"


@dataclass(frozen=True)
class Outcome:
    """`kind` is accepted, refused, set aside or finding; `where` tells findings of one cause from
    others."""

    kind: str
    where: str = ""
    detail: str = ""


def judge(target: Target, data: bytes, folder: Path) -> Outcome:
    """Use the input in `folder`, which is emptied. Any error but a refusal in our words is a
    finding."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.simplefilter("ignore", ResourceWarning)  # of files that libraries leave open
            return Outcome(target.use(data, folder))
    except target.refusals as error:
        return _refusal(target, error)
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # noqa: BLE001
        # Also what no `except Exception` of ours would catch.
        return Outcome(
            FINDING,
            f"{type(error).__name__} at {_place(error)}",
            "".join(traceback.format_exception(error)),
        )


def _refusal(target: Target, error: Exception) -> Outcome:
    """A refusal is in our own words: it names the file, and is no lack of memory in disguise."""
    message, chain = str(error), list(_causes(error))
    if any(isinstance(cause, MemoryError) for cause in chain):
        wrong = "ran out of memory"
    elif target.names not in message:
        wrong = f"does not name {target.names}"
    else:
        return Outcome(REFUSED)
    detail = "".join(traceback.format_exception(error))
    return Outcome(FINDING, f"{type(error).__name__} {wrong}, at {_place(chain[-1])}", detail)


def _causes(error: BaseException) -> Iterator[BaseException]:
    """The error, and what it came from."""
    seen: BaseException | None = error
    while seen is not None:
        yield seen
        seen = seen.__cause__ or seen.__context__


def _place(error: BaseException) -> str:
    """The innermost line of ours."""
    frames = traceback.extract_tb(error.__traceback__)
    ours = [
        f for f in frames if "site-packages" not in f.filename and "/lib/python" not in f.filename
    ]
    if not frames:
        return "a place unknown"
    frame = (ours or list(frames))[-1]
    return f"{Path(frame.filename).parent.name}/{Path(frame.filename).name}:{frame.lineno}"
