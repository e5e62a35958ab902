"""Fields of requests: bounds and units are types, so that every door has the same.

A number with a unit is given in SI, as text with a unit or as a quantity of pint. A file is given
as its path on the command line and in Python, as its content over a network.
"""

from __future__ import annotations

import base64
import binascii
import math
import tempfile
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationInfo,
    WithJsonSchema,
)
from pydantic.fields import FieldInfo

#: Where the presentation of a field is kept in its JSON schema; the doors take it out again.
_KEY = "pyroshock"


@dataclass(frozen=True)
class Presentation:
    """How doors show a field beside its type: `positional` and `metavar` on the command line,
    `completion` names what the store completes it with (`doors.command_line.completion`),
    `option` is an older spelling that commands keep, `argument` one that Python keeps, `words` says
    that the option takes all words behind it, `pair` that it takes a name and its value as two
    words, also with one letter before them, `several` that the command takes several values and
    works on one after the other, `unit` is the SI unit of its number, `lines` a form's height for a
    text of several, `label` its words in a form, `secret` a word that is neither shown nor kept:
    the command line asks for it."""

    positional: bool = False
    metavar: str = ""
    completion: str = ""
    option: str = ""
    argument: str = ""
    unit: str = ""
    lines: int = 1
    label: str = ""
    several: bool = False
    words: bool = False
    pair: bool = False
    secret: bool = False


def request_field(
    default: Any = ...,
    *,
    help: str,
    example: str = "",
    presentation: Presentation = Presentation(),
    **limits: Any,
) -> Any:
    """A field of a request: its help is one sentence; `limits` are those of `pydantic.Field`."""
    if "default_factory" not in limits:
        limits["default"] = default
    return Field(
        description=help,
        examples=[example] if example else None,
        json_schema_extra={_KEY: vars(presentation)},
        **limits,
    )


def presentation_of(field: FieldInfo) -> Presentation:
    """How a field is shown."""
    extra = field.json_schema_extra
    stated: Any = extra.get(_KEY, {}) if isinstance(extra, dict) else {}
    shown = Presentation(**stated)
    unit = next((entry.unit for entry in _metadata(field) if isinstance(entry, Unit)), "")
    return shown if not unit else Presentation(**{**vars(shown), "unit": unit})


def _metadata(field: FieldInfo) -> Iterator[Any]:
    yield from field.metadata
    pending = [field.annotation]
    while pending:
        annotation = pending.pop()
        yield from getattr(annotation, "__metadata__", ())
        pending += [kind for kind in getattr(annotation, "__args__", ()) if kind is not type(None)]


def without_presentation(schema: Any) -> Any:
    """A JSON schema for others, without what doors keep in it."""
    if isinstance(schema, dict):
        return {key: without_presentation(part) for key, part in schema.items() if key != _KEY}
    return [without_presentation(part) for part in schema] if isinstance(schema, list) else schema


def source_of(info: ValidationInfo) -> str:
    """Where the values come from (`faults.Source`)."""
    return str((info.context or {}).get("source", "python"))


# --- numbers with a unit


@dataclass(frozen=True)
class Unit:
    """The SI unit of a field's number."""

    unit: str


def quantity(unit: str, *, named: bool = False) -> Any:
    """A number in SI of this unit, from a number in SI, text with a unit or a quantity of pint.

    On the command line and in a form a bare number is refused with the unit that is expected; in a
    form it is taken where the field is `named` after its unit.
    """

    def in_si(value: Any, info: ValidationInfo) -> Any:
        from ..common.frames import si

        if value is None or (value == "" and source_of(info) == "network"):
            return None
        if isinstance(value, bool):
            raise ValueError(f"{info.field_name} is {value!r}; expected a number with a unit")
        if named and source_of(info) == "network" and isinstance(value, str):
            with suppress(ValueError):  # a text with a unit is read below
                return float(value)
        try:
            return si(value, unit, info.field_name or "value")
        except TypeError as error:
            raise ValueError(str(error)) from error

    return Annotated[float, BeforeValidator(in_si), Unit(unit)]


# --- files


class TextFile(BaseModel):
    """The content of a text file; `name` is what messages call it, `path` where it was read."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str = "the text"
    text: str
    path: Path | None = None

    @contextmanager
    def as_path(self) -> Iterator[Path]:
        """A file with the content, for readers that take a path: the one that was read where it is
        still the same."""
        if self.path is not None and self.path.is_file():
            yield self.path
            return
        with tempfile.TemporaryDirectory(prefix="pyroshock-file-") as scratch:
            path = Path(scratch) / (Path(self.name).name or "file.txt")
            path.write_text(self.text, encoding="utf-8")
            yield path


def text_file(max_bytes: int, read_text: Callable[[Path], str] | None = None) -> Any:
    """A field that takes a text file of at most `max_bytes`.

    `read_text` reads a path and raises `ValueError` in words of its format.
    """

    def of_value(value: Any, info: ValidationInfo) -> Any:
        if value is None or value == "":
            return None
        source, name = source_of(info), str(info.field_name)
        if isinstance(value, TextFile):
            return value
        if isinstance(value, Mapping):
            if source != "network":
                return value
            # a path from the network would be a file of this machine
            value = value.get("text")
        if isinstance(value, str) and (
            source in ("network", "stored")
            or (source == "python" and ("\n" in value or "=" in value))
        ):
            if len(value.encode(errors="replace")) > max_bytes:
                raise ValueError(
                    f"{name} has {len(value.encode(errors='replace')):,} bytes; expected at most "
                    f"{max_bytes:,}"
                )
            return TextFile(name=f"the {name.replace('_', ' ')}", text=value)
        if source == "network" or not isinstance(value, str | Path):
            raise ValueError(f"{name} is {value!r:.200}; expected the text of a file")
        return _read_file(Path(value), name, max_bytes, read_text)

    return Annotated[TextFile, BeforeValidator(of_value)]


def _read_file(
    path: Path, name: str, max_bytes: int, read_text: Callable[[Path], str] | None
) -> TextFile:
    if not path.is_file():
        kind = "is a folder" if path.is_dir() else "does not exist"
        raise ValueError(f"{name} is '{path}', which {kind}; expected the path of a file")
    if path.stat().st_size > max_bytes:
        raise ValueError(
            f"{name} is '{path}' of {path.stat().st_size:,} bytes; expected at most {max_bytes:,}"
        )
    try:
        text = path.read_text(encoding="utf-8-sig") if read_text is None else read_text(path)
    except UnicodeDecodeError as error:
        raise ValueError(f"{name} is '{path}', which is no text in UTF-8") from error
    return TextFile(name=str(path), text=text, path=path)


class RecordedFile(BaseModel):
    """A file of any format: where it lies on this machine, or its content over a network."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str
    content: bytes = b""
    path: Path | None = None

    @property
    def size_bytes(self) -> int:
        """The size of the file; 0 of one that is not there."""
        if self.path is None:
            return len(self.content)
        return self.path.stat().st_size if self.path.is_file() else 0

    def read_bytes(self) -> bytes:
        """All of its content."""
        return self.content if self.path is None else self.path.read_bytes()

    @contextmanager
    def as_path(self) -> Iterator[Path]:
        """The file, or one with the content and the ending of the name."""
        if self.path is not None:
            yield self.path
            return
        with tempfile.TemporaryDirectory(prefix="pyroshock-file-") as scratch:
            # a sender chooses the name: it is neither a path nor longer than a disk takes
            name = "".join(sign for sign in Path(self.name).name if sign.isprintable())
            path = Path(scratch) / (name.strip(". ")[-60:] or "recording.csv")
            path.write_bytes(self.content)
            yield path


def _recorded_file(value: Any, info: ValidationInfo) -> Any:
    source, name = source_of(info), str(info.field_name)
    if isinstance(value, RecordedFile) or value is None:
        return value
    if isinstance(value, str) and (source == "network" or (source == "python" and "\n" in value)):
        return RecordedFile(name="recording.csv", content=value.encode())
    if source != "network" and isinstance(value, str | Path):
        return RecordedFile(name=Path(value).name, path=Path(value))
    try:
        content = base64.b64decode(value["content"], validate=True)
        return RecordedFile(name=value["name"], content=content)
    except (TypeError, KeyError, ValueError, binascii.Error) as error:
        expected = 'the text of a CSV file, or {"name": "a.npz", "content": its bytes in base64}'
        raise ValueError(f"{name} is {value!r:.80}; expected {expected}") from error


#: A recording in a file: its path on the command line and in Python. Over a network it is the text
#: of a CSV file, or a name with the bytes in base64; a form uploads it.
Recorded = Annotated[
    RecordedFile,
    BeforeValidator(_recorded_file),
    WithJsonSchema({"anyOf": [{"type": "string"}, {"type": "object"}]}),
]


@dataclass(frozen=True)
class MostBytes:
    """The largest file that a field takes."""

    number: int


def any_file(most_bytes: int) -> Any:
    """A field that takes a file of any format, of at most `most_bytes`: its path on the command
    line and in Python, its name with its bytes in base64 over a network. A form uploads it."""

    def of_value(value: Any, info: ValidationInfo) -> Any:
        name, file = str(info.field_name), _file_of(value, info)
        if file.path is not None and not file.path.is_file():
            kind = "is a folder" if file.path.is_dir() else "does not exist"
            raise ValueError(f"{name} is '{file.path}', which {kind}; expected the path of a file")
        if file.size_bytes > most_bytes:
            raise ValueError(
                f"{name} is {file.name!r:.120} of {file.size_bytes:,} bytes; expected at most "
                f"{most_bytes:,}"
            )
        return file

    schema = WithJsonSchema({"type": "object"})
    return Annotated[RecordedFile, BeforeValidator(of_value), schema, MostBytes(most_bytes)]


def _file_of(value: Any, info: ValidationInfo) -> RecordedFile:
    if isinstance(value, RecordedFile):
        return value
    is_here = source_of(info) != "network"  # a path from the network would be one of this machine
    if is_here and isinstance(value, str | Path):
        return RecordedFile(name=Path(value).name, path=Path(value))
    try:
        content = base64.b64decode(value["content"], validate=True)
        return RecordedFile(name=value["name"], content=content)
    except (TypeError, KeyError, ValueError) as error:  # whatever a client sends in its place
        expected = '{"name": "plate.jpg", "content": its bytes in base64}'
        raise ValueError(f"{info.field_name} is {value!r:.80}; expected {expected}") from error


def most_upload_bytes(field: FieldInfo) -> int | None:
    """The largest file that a field says it takes; None where it says nothing."""
    limits = (entry.number for entry in _metadata(field) if isinstance(entry, MostBytes))
    return next(limits, None)


# --- lists, points and pairs


def _names(value: Any, info: ValidationInfo) -> Any:
    """`a,b` and repeated texts as names; None of them is empty. Names of a list may have commas,
    but on the command line."""
    if value is None:
        return ()
    texts = (value,) if isinstance(value, str) else value
    if not isinstance(texts, Sequence):
        return value
    divided = isinstance(value, str) or source_of(info) == "command"
    parts = [
        part
        for text in texts
        for part in (text.split(",") if divided and isinstance(text, str) else [text])
    ]
    names = (part.strip() if isinstance(part, str) else part for part in parts)
    return tuple(dict.fromkeys(name for name in names if name != ""))


def _texts(value: Any, info: ValidationInfo) -> Any:
    """Empty lines of a form and of an address are none; an empty option is a mistake, which the
    request refuses."""
    if value is None:
        return ()
    texts = value.splitlines() if isinstance(value, str) else value
    if not isinstance(texts, Collection) or not all(isinstance(text, str) for text in texts):
        return value  # no texts: the field refuses them in its own words
    typed = source_of(info) == "command"
    return tuple(text.strip() for text in texts if typed or text.strip())


#: Texts that may have commas: a list, one in each line, or repeated.
Texts = Annotated[tuple[str, ...], BeforeValidator(_texts)]

#: Names, as a list, as one text with commas, or repeated.
Names = Annotated[tuple[str, ...], BeforeValidator(_names)]

#: The number of a row of the store: what a database's integer holds.
Key = Annotated[int, Field(ge=1, le=2**31 - 1)]
#: Such numbers, as a list, as one text with commas, or repeated.
Keys = Annotated[tuple[Key, ...], BeforeValidator(_names)]


def _points(value: Any, info: ValidationInfo) -> Any:
    if value is None or value == "":
        return ()
    texts = value.split(";") if isinstance(value, str) else value
    return tuple(_point(part, str(info.field_name)) for part in texts)


def _point(value: Any, name: str) -> tuple[float, float]:
    parts = value.split(",") if isinstance(value, str) else value
    try:
        x, y = (float(part) for part in parts)
    except (TypeError, ValueError) as error:
        raise ValueError(
            f"{name} is {value!r}; expected two numbers in m, such as 0.47,0.28"
        ) from error
    if not (math.isfinite(x) and math.isfinite(y)):
        raise ValueError(f"{name} is {value!r}; expected finite numbers in m")
    return x, y


#: Places upon the outline of the plate, in m: "0.47,0.28", or pairs of numbers.
Points = Annotated[tuple[tuple[float, float], ...], BeforeValidator(_points)]

Value = TypeVar("Value")


@dataclass(frozen=True)
class Spelling:
    """How a value of a field of pairs is written behind its key, so that it is read as it was."""

    spell: Callable[[str, Any], str]


def pairs(
    parse: Callable[[str, str, Any], Value],
    of: Any,
    spell: Callable[[str, Value], str] | None = None,
) -> Any:
    """A field of names with values: a mapping, or texts such as "NAME=VALUE".

    `parse(name of the field, key, value)` reads a value, which of a text is what stands behind the
    sign of equality, "" where there is none; `of` is the type of what it returns. `spell(key,
    value)` writes a value as `parse` reads it, where that is not its usual text.
    """

    def of_value(value: Any, info: ValidationInfo) -> Any:
        field_name = str(info.field_name)
        if value is None or value == "":
            return {}
        if isinstance(value, Mapping):
            return {str(key): parse(field_name, str(key), part) for key, part in value.items()}
        texts = value.replace("\n", ",").split(",") if isinstance(value, str) else value
        read: dict[str, Value] = {}
        for text in texts:
            for item in str(text).split(","):
                key, _, part = item.partition("=")
                if key.strip():
                    read[key.strip()] = parse(field_name, key.strip(), part.strip())
        return read

    spelling = () if spell is None else (Spelling(spell),)
    return Annotated[(dict[str, of], BeforeValidator(of_value), *spelling)]


def spelling_of(field: FieldInfo) -> Spelling | None:
    """How the values of a field of pairs are written; None: as usual."""
    return next((entry for entry in _metadata(field) if isinstance(entry, Spelling)), None)


def row_limit(usual: int, most: int) -> Any:
    """How many rows are answered, or None for all; over a network `most` at the most, and `usual`
    where nobody says. The field validates its default."""

    def of_network(limit: int | None, info: ValidationInfo) -> int | None:
        if source_of(info) != "network":
            return limit
        if limit is not None and limit > most:
            raise ValueError(
                f"{info.field_name} is {limit}; expected a whole number from 1 to {most} over a "
                "network"
            )
        return limit or usual

    return Annotated[Annotated[int, Field(ge=1)] | None, AfterValidator(of_network)]


#: Seeds of every generator of random numbers here.
Seed = Annotated[int, Field(ge=0, le=2**31 - 1)]
#: Above 0, up to 1.
Share = Annotated[float, Field(gt=0, le=1)]
