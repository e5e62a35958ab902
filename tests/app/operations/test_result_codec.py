"""Results travel as JSON and come back as they were; nothing else comes back."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.app.operations.result_codec import CodecError, decode, encode


def sent(value: Any) -> Any:
    """A value after its way over a network."""
    return decode(json.loads(json.dumps(encode(value), allow_nan=False)))


PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(),
    lambda parts: (
        st.lists(parts)
        | st.lists(parts).map(tuple)
        | st.dictionaries(st.text() | st.integers() | st.tuples(st.text(), st.integers()), parts)
    ),
    max_leaves=20,
)


@given(PLAIN)
def test_plain_data_comes_back_with_its_types(value: Any) -> None:
    assert repr(sent(value)) == repr(value)


def test_a_mapping_with_the_mark_of_the_codec_stays_a_mapping() -> None:
    assert sent({"~": "path", "value": "/etc/passwd"}) == {"~": "path", "value": "/etc/passwd"}


@pytest.mark.parametrize(
    "array",
    [
        np.array([1.5, np.nan, -np.inf]),
        np.arange(6, dtype=np.int32).reshape(2, 3).T,
        np.array(["steel", "δ"]),
        np.array([True, False]),
        np.zeros((0, 4)),
        np.array([1 + 2j]),
        np.array([">", 3.0, None], dtype=object),
    ],
)
def test_arrays_come_back_with_shape_and_type(array: Any) -> None:
    back = sent(array)
    assert (back.shape, back.dtype) == (array.shape, array.dtype)
    assert repr(back.tolist()) == repr(array.tolist())
    assert back.flags.writeable


def test_times_numbers_of_numpy_and_paths_come_back() -> None:
    value = [datetime(2026, 3, 1, 12, 30, 0, 5, UTC), np.float64(2.5), Path("a/b"), {3, 1}]
    assert repr(sent(value)) == repr(value)


# --- what a server may not make


@pytest.mark.parametrize(
    "name",
    [
        "os:system",
        "app.server.command:serve",
        "app.common.errors:StorageError",
        "__main__:main",
        "app.operations.result_codec:importlib",
        "app.operations.operation:dataclass",
        "app.operations.operation:BaseModel",
        "app.operations..operation:Outcome",
        "app.operationsx.evil:Outcome",
        "app.operations.operation:Outcome.__init__",
        "app.operations.no_such_module:Outcome",
        "app.operations.predict.predict:PredictionRequest",
    ],
)
def test_a_server_makes_no_object_but_records_of_results(name: str) -> None:
    with pytest.raises(CodecError, match="answer"):
        decode({"~": "record", "type": name, "fields": {}})


def test_no_code_of_a_record_runs_while_it_is_read(monkeypatch: pytest.MonkeyPatch) -> None:
    from pyroshock.twin.gun.effects.valve_flow import ValveFlow

    data = encode(ValveFlow())
    monkeypatch.setattr(ValveFlow, "__init__", lambda *_, **__: pytest.fail("it ran"))
    assert decode(data).id == "gun.valve_flow"


def test_a_record_with_other_fields_says_which() -> None:
    from pyroshock.app.operations.operation import Outcome

    data = encode(Outcome(("done",), {}))
    data["fields"]["colour"] = data["fields"].pop("page")
    with pytest.raises(CodecError, match=r"Outcome.*only here: page; only there: colour"):
        decode(data)


def test_packed_bytes_are_not_unpacked_beyond_the_array() -> None:
    data = encode(np.zeros(1_000_000))
    data["shape"] = [2]
    with pytest.raises(CodecError, match="17 bytes for an array of 16"):
        decode(data)


@pytest.mark.parametrize(
    "data",
    [
        {"~": "array", "dtype": "O", "shape": [1], "zlib": ""},
        {"~": "array", "dtype": "<f8", "shape": [2**40], "zlib": ""},
        {"~": "array", "dtype": "<f8", "shape": [-1], "zlib": "eJwDAAAAAAE="},
        {"~": "array", "dtype": "<f8", "shape": [1], "zlib": "no base64"},
        {"~": "tuple"},
        {"~": "tuple", "items": 3},
        {"~": "time", "value": "yesterday"},
        {"~": ["array"]},
        {"~": "pickle", "value": "gASVAA=="},
        {"~": "frame", "columns": [["a", 1]], "attrs": []},
        {"~": "choice", "type": "app.figures.figure:ColourRole", "name": "none"},
        {"~": "effect", "id": "gun.none", "values": {}},
        {"~": "mapping", "items": [[[], 1]]},
    ],
)
def test_what_is_no_answer_is_told_so(data: Any) -> None:
    with pytest.raises(CodecError, match="answer"):
        decode(data)


def test_deep_nesting_is_refused() -> None:
    data: Any = []
    for _ in range(100_000):
        data = [data]
    with pytest.raises(CodecError, match="too deeply"):
        decode(data)
