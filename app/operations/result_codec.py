"""Results as JSON and back, without a declaration for each: a record is its fields by name.

`to_json` of a result is what a person's program reads, and leaves out what can be reckoned again.
What stands here keeps everything, so that a client of another machine has the same object, with the
same tables, figures and frames. JSON alone is read: nothing that is decoded is a program, only
records of the rooms in `_ROOMS` are made, and none of their methods runs meanwhile.
"""

from __future__ import annotations

import base64
import dataclasses
import enum
import importlib
import math
import zlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from datetime import date, datetime
from pathlib import Path, PurePath
from types import FunctionType
from typing import TYPE_CHECKING, Any

import numpy as np

from .operation import Batches, Request, Result

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: What marks an object of JSON that stands for something else than a mapping.
_MARK = "~"
_PACKAGE = __name__.removesuffix(".app.operations.result_codec")
#: Modules of the package whose records may be made of what a server sends. None of them does
#: anything when it is imported, and their records hold values alone.
_ROOMS = (
    "app.documents.document",
    "app.figures.figure",
    "app.jobs.job_operations",
    "app.jobs.queue",
    "app.operations.",
    "app.twins.building",
    "dataset.",
    "diagnosis.",
    "doe.",
    "ingest.",
    "schema.diagnoses",
    "signals.",
    "training.evaluation.",
    "training.models.base",
    "training.registry.",
    "twin.",
    "validation.",
    "virtualbench.",
)
#: Kinds of elements of an array that are plain numbers, truth values or texts.
_KINDS = frozenset("biufcU")
#: An array of one answer has so many bytes at most; a recording of an hour at 100 kHz has 3 GB, and
#: is read in slices.
_MOST_BYTES = 2**31


class CodecError(ValueError):
    """A value that cannot travel, or an answer that cannot be read: mostly of another version."""


@dataclass(frozen=True, eq=False)
class Made:
    """A function without arguments whose value was reckoned before it was sent."""

    value: Any

    def __call__(self) -> Any:
        return self.value


# --- to JSON


def encode(value: Any) -> Any:
    """A value as data that `json.dumps` writes and `decode` reads.

    Parameters:
        value: Plain data, arrays, dates, records (dataclasses) of these, or a function without
            arguments that gives such a value.

    Raises:
        CodecError: For a value of another kind.
    """
    kind = type(value)
    if kind is str or kind is int or kind is bool or value is None:
        return value
    if kind is float:
        return value if math.isfinite(value) else {_MARK: "float", "value": repr(value)}
    if kind is list:
        return [encode(part) for part in value]
    if kind is dict:
        return _encoded_mapping(value)
    if kind is tuple:
        return {_MARK: "tuple", "items": [encode(part) for part in value]}
    return _encoded_object(value)


def _encoded_mapping(value: Mapping[Any, Any]) -> Any:
    if all(type(key) is str for key in value) and _MARK not in value:
        return {key: encode(part) for key, part in value.items()}
    items = [[encode(key), encode(part)] for key, part in value.items()]
    return {_MARK: "mapping", "items": items}


def _encoded_object(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return _encoded_array(value)
    if isinstance(value, np.generic):
        return {_MARK: "number", "of": _encoded_array(np.asarray(value))}
    if isinstance(value, enum.Enum):
        return {_MARK: "choice", "type": _name(type(value)), "name": value.name}
    if isinstance(value, set | frozenset):
        items = [encode(part) for part in sorted(value, key=repr)]
        return {_MARK: "frozenset" if isinstance(value, frozenset) else "set", "items": items}
    if isinstance(value, date):  # a time is a date, too
        kind = "time" if isinstance(value, datetime) else "date"
        return {_MARK: kind, "value": value.isoformat()}
    if isinstance(value, bytes):
        return {_MARK: "bytes", "base64": base64.b64encode(value).decode()}
    if isinstance(value, PurePath):
        return {_MARK: "path", "value": str(value)}
    if (own := _OWN_ENCODERS.get(_name(type(value)))) is not None:
        return own(value)
    if dataclasses.is_dataclass(value):
        return _encoded_record(value)
    if hasattr(value, "__mapper__"):
        return _encoded_row(value)
    if isinstance(value, Result):
        return _encoded_result(value)
    if isinstance(value, Request):
        return _encoded_request(value)
    if type(value).__module__.partition(".")[0] == "pandas":
        return _encoded_table(value)
    # subclasses of plain types that libraries give, such as the names of columns of SQLAlchemy
    plain: type[Any]
    for plain in (str, int, float, list, tuple):
        if isinstance(value, plain):
            return encode(plain(value))
    if isinstance(value, Mapping):
        return _encoded_mapping(value)
    if isinstance(value, FunctionType):
        return {_MARK: "made", "value": encode(value())}
    raise CodecError(f"a value of {_name(type(value))} cannot be sent as JSON")


def _encoded_record(value: Any) -> Any:
    if isinstance(value, Made):
        return {_MARK: "made", "value": encode(value.value)}
    name = _name(type(value))
    if not name.startswith(f"{_PACKAGE}."):
        return _encoded_effect(value)
    fields = {part.name: encode(getattr(value, part.name)) for part in dataclasses.fields(value)}
    return {_MARK: "record", "type": name.removeprefix(f"{_PACKAGE}."), "fields": fields}


def _encoded_effect(value: Any) -> Any:
    """An effect of another package is read by its name in the catalogue, where that package is."""
    from ...twin.effects import Effect

    if not isinstance(value, Effect):
        raise CodecError(f"a record of {_name(type(value))} cannot be sent as JSON")
    values = {part.name: encode(getattr(value, part.name)) for part in dataclasses.fields(value)}
    return {_MARK: "effect", "id": value.id, "values": values}


def _encoded_result(value: Result) -> Any:
    """A result that is no dataclass, such as a plan, is its attributes."""
    fields = {name: encode(part) for name, part in vars(value).items()}
    name = _name(type(value)).removeprefix(f"{_PACKAGE}.")
    return {_MARK: "result", "type": name, "fields": fields}


def _encoded_request(value: Request) -> Any:
    """A request that a result keeps, by the fields that were given."""
    fields = {name: encode(getattr(value, name)) for name in sorted(value.model_fields_set)}
    name = _name(type(value)).removeprefix(f"{_PACKAGE}.")
    return {_MARK: "request", "type": name, "fields": fields}


def _encoded_row(value: Any) -> Any:
    """The columns of a row of the store that were read; what it refers to stays there."""
    columns = {name: encode(vars(value)[name]) for name in _columns(type(value), vars(value))}
    name = _name(type(value)).removeprefix(f"{_PACKAGE}.")
    return {_MARK: "row", "type": name, "columns": columns}


def _columns(kind: Any, read: Mapping[str, Any]) -> list[str]:
    return [attribute.key for attribute in kind.__mapper__.column_attrs if attribute.key in read]


def _encoded_array(value: NDArray[Any]) -> Any:
    if value.dtype.kind == "O":
        return {
            _MARK: "objects",
            "shape": list(value.shape),
            "items": [encode(part) for part in value.ravel().tolist()],
        }
    if value.dtype.kind not in _KINDS:
        raise CodecError(f"an array of {value.dtype} cannot be sent as JSON")
    plain = np.ascontiguousarray(value, dtype=value.dtype.newbyteorder("<"))
    return {
        _MARK: "array",
        "dtype": plain.dtype.str,
        "shape": list(value.shape),
        "zlib": base64.b64encode(zlib.compress(plain.tobytes(), 1)).decode(),
    }


def _encoded_table(value: Any) -> Any:
    import pandas as pd

    if isinstance(value, pd.DataFrame):
        columns = [[encode(name), _encoded_column(value[name])] for name in value.columns]
        return {_MARK: "frame", "columns": columns, "attrs": encode(dict(value.attrs))}
    raise CodecError(f"a value of {_name(type(value))} cannot be sent as JSON")


def _encoded_column(column: Any) -> Any:
    if column.dtype.kind in "biufc" and isinstance(column.dtype, np.dtype):
        return _encoded_array(column.to_numpy())
    missing = column.isna()
    items = [
        encode(part.to_pydatetime() if hasattr(part, "to_pydatetime") else part)
        if not empty or part is None or isinstance(part, float)
        else None
        for part, empty in zip(column.tolist(), missing, strict=True)
    ]
    return {_MARK: "column", "dtype": str(column.dtype), "items": items}


def _name(kind: type) -> str:
    return f"{kind.__module__}:{kind.__qualname__}"


def _encoded_built_twin(built: Any) -> Any:
    """What a result tells of the twin that made it; the twin itself stays where it was built."""
    from .predict.described_twin import describe

    return _encoded_record(describe(built))


def _encoded_batches(batches: Any) -> Any:
    return {
        _MARK: "batches",
        "columns": [encode(column) for column in batches.columns],
        "rows": [[encode(row[name]) for name in batches.columns] for row in batches.rows],
    }


#: What is sent in the place of a record that cannot travel.
_OWN_ENCODERS: dict[str, Callable[[Any], Any]] = {
    f"{_PACKAGE}.app.operations.operation:Batches": _encoded_batches,
    f"{_PACKAGE}.app.twins.building:BuiltTwin": _encoded_built_twin,
}


# --- from JSON


def decode(data: Any) -> Any:
    """The value that `encode` has written.

    Parameters:
        data: What `json.loads` has read; it may be anything.

    Raises:
        CodecError: For what `encode` never writes, and for a record that this version does not have
            or that has other fields here.
    """
    try:
        return _decoded(data)
    except CodecError:
        raise
    except RecursionError as error:
        raise CodecError("the answer is nested too deeply to be read") from error
    except (KeyError, TypeError, ValueError, AttributeError, ImportError, zlib.error) as error:
        # whatever a server sends in the place of what `encode` writes
        raise CodecError(f"the answer cannot be read: {type(error).__name__}: {error}") from error


def _decoded(data: Any) -> Any:
    if isinstance(data, list):
        return [_decoded(part) for part in data]
    if not isinstance(data, dict):
        return data
    kind = data.get(_MARK)
    if kind is None:
        return {key: _decoded(part) for key, part in data.items()}
    reader = _READERS.get(kind) if isinstance(kind, str) else None
    if reader is None:
        raise CodecError(
            f"the answer has a value of the kind {kind!r:.80}, which is not known here"
        )
    return reader(data)


def _items(data: Any) -> Iterator[Any]:
    return (_decoded(part) for part in data["items"])


def _mapping(data: Any) -> dict[Any, Any]:
    return {_decoded(key): _decoded(part) for key, part in data["items"]}


def _number(data: Any) -> Any:
    return _decoded(data["of"])[()]


def _path(data: Any) -> Path:
    return Path(str(data["value"]))


def _array(data: Any) -> NDArray[Any]:
    dtype, shape = np.dtype(str(data["dtype"])), tuple(int(part) for part in data["shape"])
    if dtype.kind not in _KINDS or any(part < 0 for part in shape):
        raise CodecError(f"the answer has an array of {dtype} and shape {shape}")
    size = math.prod(shape) * dtype.itemsize
    if size > _MOST_BYTES:
        raise CodecError(f"the answer has an array of {size:,} bytes; at most {_MOST_BYTES:,}")
    # No more is unpacked than the array has, whatever the sender packed.
    unpacked = zlib.decompressobj().decompress(base64.b64decode(data["zlib"]), size + 1)
    if len(unpacked) != size:
        raise CodecError(f"the answer has {len(unpacked):,} bytes for an array of {size:,}")
    # a copy, for what lies in bytes cannot be written to
    return np.frombuffer(unpacked, dtype).reshape(shape).astype(dtype.newbyteorder("="))


def _objects(data: Any) -> NDArray[Any]:
    items = list(_items(data))
    array = np.empty(len(items), dtype=object)
    array[:] = items
    return array.reshape([int(part) for part in data["shape"]])


def _choice(data: Any) -> enum.Enum:
    kind = _class_of(str(data["type"]).removeprefix(f"{_PACKAGE}."))
    if not issubclass(kind, enum.Enum):
        raise CodecError(f"the answer has {data['type']!r:.80}, which is no choice")
    return kind[str(data["name"])]


def _record(data: Any) -> Any:
    name = str(data["type"])
    kind = _class_of(name)
    if not dataclasses.is_dataclass(kind):
        raise CodecError(f"the answer has a record {name!r:.80}, which is none here")
    sent = data["fields"]
    expected = {part.name for part in dataclasses.fields(kind)}
    if set(sent) != expected:
        only_here, only_there = sorted(expected - set(sent)), sorted(set(sent) - expected)
        raise CodecError(
            f"the answer has a record {name} with other fields than here (only here: "
            f"{', '.join(only_here) or 'none'}; only there: {', '.join(only_there) or 'none'})"
        )
    # Neither __init__ nor __post_init__: the values were checked where the record was made.
    record = object.__new__(kind)
    for field_name, part in sent.items():
        object.__setattr__(record, field_name, _decoded(part))
    return record


def _result(data: Any) -> Any:
    kind = _class_of(str(data["type"]))
    if not issubclass(kind, Result) or any(hasattr(kind, name) for name in data["fields"]):
        raise CodecError(f"the answer has a result {data['type']!r:.80} that is none here")
    result = object.__new__(kind)
    for name, part in data["fields"].items():
        object.__setattr__(result, name, _decoded(part))
    return result


def _request(data: Any) -> Any:
    kind: Any = _class_of(str(data["type"]))
    fields = data["fields"]
    if not issubclass(kind, Request) or set(fields) - set(kind.model_fields):
        raise CodecError(f"the answer has a request {data['type']!r:.80} that is none here")
    values = {name: _decoded(part) for name, part in fields.items()}
    # Not validated again: the values were checked where the request was read.
    return kind.model_construct(set(values), **values)


def _row(data: Any) -> Any:
    kind: Any = _class_of(str(data["type"]))
    if not hasattr(kind, "__mapper__") or set(data["columns"]) - set(
        _columns(kind, data["columns"])
    ):
        raise CodecError(f"the answer has a row {data['type']!r:.80} that is none of this version")
    # of no session: what is changed of it is stored nowhere
    return kind(**{name: _decoded(part) for name, part in data["columns"].items()})


def _class_of(name: str) -> type:
    """A class of the package in a room whose records may be made."""
    module_name, _, qualified = name.partition(":")
    if not f"{module_name}.".startswith(tuple(room.rstrip(".") + "." for room in _ROOMS)):
        raise CodecError(f"the answer has a record {name!r:.200}, which no answer may hold")
    value: Any = importlib.import_module(f"{_PACKAGE}.{module_name}")
    for part in qualified.split("."):
        value = vars(value).get(part)
    # A name that the module has imported from elsewhere is not one of its classes.
    if not isinstance(value, type) or _name(value) != f"{_PACKAGE}.{name}":
        raise CodecError(f"the answer has a record {name!r:.200}, which is not known here")
    return value


def _effect(data: Any) -> Any:
    from ...twin.effects import effect

    try:
        return effect(str(data["id"]), **{k: _decoded(v) for k, v in data["values"].items()})
    except LookupError as error:
        raise CodecError(
            f"the answer has the effect {data['id']!r:.80} of another package, which is not "
            "installed here"
        ) from error


def _frame(data: Any) -> Any:
    import pandas as pd

    columns = {_decoded(name): _decoded(column) for name, column in data["columns"]}
    frame = pd.DataFrame(columns)
    frame.attrs.update(_decoded(data["attrs"]))
    return frame


def _column(data: Any) -> Any:
    import pandas as pd

    return pd.Series(list(_items(data)), dtype=str(data["dtype"]))


def _batches(data: Any) -> Any:
    names = tuple(map(str, data["columns"]))
    rows = [[_decoded(part) for part in row] for row in data["rows"]]
    columns = {name: [row[place] for row in rows] for place, name in enumerate(names)}
    return Batches(names, iter([columns] if rows else []))


_READERS: dict[str, Callable[[Any], Any]] = {
    "float": lambda data: float(data["value"]),
    "tuple": lambda data: tuple(_items(data)),
    "set": lambda data: set(_items(data)),
    "frozenset": lambda data: frozenset(_items(data)),
    "mapping": _mapping,
    "array": _array,
    "objects": _objects,
    "number": _number,
    "choice": _choice,
    "bytes": lambda data: base64.b64decode(data["base64"], validate=True),
    "time": lambda data: datetime.fromisoformat(data["value"]),
    "date": lambda data: date.fromisoformat(data["value"]),
    "path": _path,
    "record": _record,
    "result": _result,
    "request": _request,
    "row": _row,
    "effect": _effect,
    "made": lambda data: Made(_decoded(data["value"])),
    "frame": _frame,
    "column": _column,
    "batches": _batches,
}
