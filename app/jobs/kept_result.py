"""What a job keeps beside its data: the whole result for clients of another machine, and which kind
of error ended it."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..operations.operation import Result


_DATA, _WHOLE, _FAULT = "~data", "~result", "~fault"
#: A larger result is not kept twice: the data of a job and its page stay.
_MOST_CHARACTERS = 64_000_000


def whole_of(result: Result) -> Any:
    """The result for `operations.result_codec.decode`.

    None of one that is too large, or holds what cannot travel.
    """
    from ..operations.result_codec import CodecError, encode  # it loads NumPy; a list needs none

    try:
        whole = encode(result)
    except CodecError:  # a plugin's own record: the job is done all the same, and its data is kept
        return None
    return whole if len(json.dumps(whole)) <= _MOST_CHARACTERS else None


def kept(data: Any, whole: Any = None, fault: str = "") -> Any:
    """What the row of a job holds of its data, its whole result and the kind of its error."""
    if whole is None and not fault:
        return data
    return {_DATA: data, _WHOLE: whole, _FAULT: fault}


def data_of(stored: Any) -> Any:
    """The data of a job for scripts and pages, of what its row holds."""
    return stored[_DATA] if _is_kept(stored) else stored


def stored_whole(stored: Any) -> Any:
    """The whole result, of what the row of a job holds; None where it has none."""
    return stored[_WHOLE] if _is_kept(stored) else None


def stored_fault(stored: Any) -> str:
    """Which kind of error has ended a job: "not found", "invalid" or "storage"; else empty."""
    return str(stored[_FAULT]) if _is_kept(stored) else ""


def _is_kept(stored: Any) -> bool:
    return isinstance(stored, dict) and stored.keys() == {_DATA, _WHOLE, _FAULT}


def fault_of(error: Exception) -> str:
    """The kind of an error, as `library_errors` tells errors apart."""
    if isinstance(error, LookupError):
        return "not found"
    return "invalid" if isinstance(error, ValueError) else "storage"
