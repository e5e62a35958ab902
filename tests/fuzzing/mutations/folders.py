"""A campaign folder as one input, and damage to the files in it."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path, PurePosixPath
from random import Random

from fuzzing.mutations import binary, tables, toml
from fuzzing.mutations.tables import NASTY
from fuzzing.target import Mutate

Files = dict[str, bytes]
_MOST_FILES = 20


def pack(files: Files) -> bytes:
    """One line of names and lengths, then the contents."""
    head = json.dumps([[name, len(content)] for name, content in files.items()])
    return head.encode() + b"\n" + b"".join(files.values())


def unpack(data: bytes) -> Files:
    """The files of a packed folder; of anything else one file."""
    head, _, rest = data.partition(b"\n")
    try:
        entries = [(str(name), int(size)) for name, size in json.loads(head)][:_MOST_FILES]
    except (ValueError, TypeError, RecursionError):
        return {"campaign.toml": data}
    files = {}
    for name, size in entries:
        files[name], rest = rest[: max(0, size)], rest[max(0, size) :]
    return files


def write(data: bytes, folder: Path) -> None:
    """The files below `folder`; what is no name of a file there is left out."""
    for name, content in unpack(data).items():
        path = folder / name.replace("\0", "")
        if not path.resolve().is_relative_to(folder) or len(PurePosixPath(name).parts) > 4:
            continue
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        except OSError:
            continue


def damaged_by(formats: Mapping[str, Mutate]) -> Mutate:
    """Damage to one file or two, each after its kind; `formats` gives the recordings' by suffix."""

    def mutate(data: bytes, rng: Random, others: Sequence[bytes]) -> bytes:
        files = unpack(data)
        for _n in range(rng.choice((1, 1, 2))):
            if not files:
                break
            name = rng.choice(list(files))
            if rng.random() < 0.05:
                _misplace(files, name, rng, others)
                continue
            files[name] = _mutation_of(name, formats)(files[name], rng, _alike(name, others))
        return pack(files)

    return mutate


def _mutation_of(name: str, formats: Mapping[str, Mutate]) -> Mutate:
    if name.endswith(".toml"):
        return toml.damaged
    if "/" not in name and name.endswith(".csv"):
        return tables.damaged
    return formats.get(PurePosixPath(name).suffix, binary.damaged)


def _alike(name: str, others: Sequence[bytes]) -> list[bytes]:
    """The files of other folders that have the same suffix."""
    suffix = PurePosixPath(name).suffix
    return [
        content
        for other in others[:8]
        for n, content in unpack(other).items()
        if n.endswith(suffix)
    ]


def _misplace(files: Files, name: str, rng: Random, others: Sequence[bytes]) -> None:
    """A file that is missing, called otherwise, or of another campaign."""
    content = files.pop(name)
    what = rng.randrange(3)
    if what == 0 and rng.choice(NASTY):
        files[rng.choice(NASTY)[:200]] = content
    elif what == 1 and others:
        files.update(unpack(rng.choice(others)))
