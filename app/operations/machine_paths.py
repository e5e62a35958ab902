"""Folders and files of this machine as fields of requests.

On the command line and in Python any path is taken. Over the network it is a campaign folder below
those that the server may read, or what a route has made of an upload: links are followed before
that is decided, and a refusal says nothing of what lies outside (CWE-22).
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, ClassVar

from pydantic import BaseModel, BeforeValidator, ConfigDict, ValidationInfo, WithJsonSchema

from .fields import source_of
from .laboratory import Laboratory
from .operation import NotHereError, Request
from .upload_folders import is_scratch

#: The file that makes a folder one of a campaign.
CARD = "campaign.toml"
#: A tree of a million files is not walked through for a list of suggestions.
_DEPTH, _MOST = 3, 200
#: Of a path, and of a name in it: file systems of Linux, macOS and Windows have no longer names.
_MOST_CHARACTERS, _MOST_BYTES_OF_NAME = 4000, 255


class PathError(ValueError):
    """A path is not one that may be read; nothing of it is told but what was given."""


class MachinePath(BaseModel):
    """A folder or file of this machine; `scratch` is the folder of the upload that it lies in,
    which goes once the work is over. `form` is the job whose form wrote the folder's campaign.toml:
    its files stay for a correction."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    #: What a refusal says that such a field takes.
    expected: ClassVar[str] = "a path"

    path: Path
    scratch: Path | None = None
    form: int | None = None

    def __str__(self) -> str:
        return str(self.path)

    def readable(self, laboratory: Laboratory) -> Path:
        """The path, where it lies in its upload or below what this machine's laboratory may read.

        Raises `NotHereError` where it does not, and `LookupError` where nothing is there any more.
        """
        if laboratory.folders is None:
            return self.path
        path = self.path.resolve()
        roots = laboratory.folders
        if self.scratch is not None:
            roots = (self.scratch,) if is_scratch(self.scratch) else ()
        if not any(path.is_relative_to(root.resolve()) for root in roots):
            raise NotHereError(f"this one may not read {path} (pyroshock work --data FOLDER)")
        if not path.exists():
            again = "upload it again" if self.scratch else "give it as it is called now"
            raise LookupError(f"no folder {str(path)!r} any more; {again}")
        return path


def confined(path: str, roots: Sequence[Path], *, described: bool = True) -> Path:
    """The folder behind a path, links followed, if it lies below one of `roots` and holds a
    campaign; one that is not `described` need not have a campaign.toml.

    Raises `PathError` otherwise, in the same words whether or not there is something outside.
    """
    if not roots:
        raise PathError(
            "no folder may be read: start with pyroshock serve --data "
            "FOLDER, or upload the campaign"
        )
    check_lengths(path)
    if "\0" in path:
        raise PathError(f"{path!r} is no path")
    for root in (root_path.resolve() for root_path in roots):
        try:
            resolved = (
                root / path
            ).resolve()  # a path that begins at the root of the disk stands for itself
            if not resolved.is_relative_to(root) or not resolved.is_dir():
                continue
            if not described or (resolved / CARD).is_file():
                return resolved
        except (OSError, RuntimeError):  # what cannot be looked at is no folder to read
            continue
    # the last part alone: where the server keeps its folders is nobody's business
    root_names = ", ".join(root.name or "the disk" for root in roots)
    kind = f"campaign folder (one with a {CARD})" if described else "folder"
    raise PathError(f"{path!r} is no {kind} below {root_names}")


def check_lengths(path: str) -> None:
    """Raises `PathError` for a path, or a name in it, that is longer than any file system has."""
    if len(path) > _MOST_CHARACTERS:
        raise PathError(f"it has {len(path)} characters; a path has at most {_MOST_CHARACTERS}")
    longest = max(len(os.fsencode(name)) for name in path.split("/"))
    if longest > _MOST_BYTES_OF_NAME:
        raise PathError(
            f"a name in it has {longest} bytes; the name of a file or folder has at most "
            f"{_MOST_BYTES_OF_NAME}"
        )


def shown_path(path: str, roots: Sequence[Path]) -> str:
    """A path as a page shows it and `confined` takes it: relative to the folder below which it
    lies; of any other, its last part."""
    for root in (root_path.resolve() for root_path in roots):
        if Path(path).is_relative_to(root):
            return Path(path).relative_to(root).as_posix()
    return Path(path).name


def campaigns_below(roots: Sequence[Path]) -> list[str]:
    """Paths of campaign folders below `roots`, as `confined` takes them; the first 200."""
    campaigns = []
    for root in roots:
        for folder in _walked(root.resolve(), _DEPTH):
            campaigns.append(str(folder))
            if len(campaigns) == _MOST:
                return campaigns
    return campaigns


def _walked(folder: Path, depth: int) -> Iterator[Path]:
    try:
        if (folder / CARD).is_file():
            yield folder
            return
        below = (
            sorted(child for child in folder.iterdir() if child.is_dir() and not child.is_symlink())
            if depth
            else []
        )
    except OSError:
        return
    for child in below:
        if not child.name.startswith("."):
            yield from _walked(child, depth - 1)


def _path_of(value: Any, info: ValidationInfo, *, described: bool = True) -> Any:
    source, name = source_of(info), str(info.field_name)
    if isinstance(value, MachinePath) or value is None:
        return value
    if source == "stored" and isinstance(value, Mapping):
        return value
    if not isinstance(value, str | os.PathLike) or value == "":
        raise ValueError(f"{name} is {value!r:.200}; expected a path")
    try:
        if source != "network":
            check_lengths(str(value))
            return MachinePath(path=Path(value))
        roots = (info.context or {}).get("folders", ())
        return MachinePath(path=confined(str(value), roots, described=described))
    except PathError as error:
        raise ValueError(f"{name}: {error}") from error


#: A campaign folder.
CampaignFolder = Annotated[
    MachinePath, BeforeValidator(_path_of), WithJsonSchema({"type": "string", "maxLength": 4000})
]


def _recordings_of(value: Any, info: ValidationInfo) -> Any:
    return _path_of(value, info, described=False)


#: A folder of recordings, which need not have a campaign.toml yet.
RecordingFolder = Annotated[
    MachinePath,
    BeforeValidator(_recordings_of),
    WithJsonSchema({"type": "string", "maxLength": 4000}),
]


def _file_of(value: Any, info: ValidationInfo) -> Any:
    if source_of(info) == "network" and not isinstance(value, MachinePath):
        raise ValueError(f"{info.field_name} is a file of the server; expected an upload")
    return _path_of(value, info)


#: A file that no request over the network may name: a route that takes an upload does.
MachineFile = Annotated[MachinePath, BeforeValidator(_file_of), WithJsonSchema({"type": "string"})]


def scratches_of(request: Request) -> list[Path]:
    """The folders of the uploads that a request is about."""
    values = (getattr(request, name) for name in type(request).model_fields)
    return [value.scratch for value in values if isinstance(value, MachinePath) and value.scratch]


def _new_file_of(value: Any, info: ValidationInfo) -> Any:
    if value is not None and source_of(info) == "network":
        raise ValueError(f"{info.field_name} is {value!r:.200}; expected none: the server names it")
    return value


#: A file that is written; a request over the network cannot name one.
NewFile = Annotated[Path, BeforeValidator(_new_file_of)]
