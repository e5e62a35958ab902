"""Whether a result is the same after its way over a network."""

from __future__ import annotations

import json
from typing import Any

from pyroshock.app.common.number_format import finite
from pyroshock.app.operations.operation import Result
from pyroshock.app.operations.result_codec import decode, encode


def sent(value: Any) -> Any:
    """A value after its way over a network."""
    return decode(json.loads(json.dumps(encode(value), allow_nan=False)))


def assert_same_result(local: Result, remote: Result) -> None:
    """Type, JSON, words, tables and figures of two results are the same."""
    assert type(remote) is type(local)
    for name in ("to_json", "to_network_json", "job_data", "notes", "sentences", "tables", "text"):
        expected, sent_answer = (getattr(result, name)() for result in (local, remote))
        assert plain(sent_answer) == plain(expected), name
    assert plain(list(map(encode, remote.figures()))) == plain(list(map(encode, local.figures())))
    for name in ("exit_code", "fault", "summary", "address", "next_command", "stored_keys"):
        expected, sent_answer = (getattr(result, name) for result in (local, remote))
        assert plain(sent_answer() if callable(sent_answer) else sent_answer) == plain(
            expected() if callable(expected) else expected
        ), name


def plain(value: Any) -> Any:
    """As JSON, records of tables and sentences by their text."""
    return json.loads(json.dumps(finite(value), default=_words, sort_keys=True))


def _words(value: Any) -> Any:
    if hasattr(value, "tolist"):
        return finite(value.tolist())
    return finite(vars(value)) if hasattr(value, "__dict__") else str(value)
