"""What a job keeps beside its data: the whole result for clients of another machine, and which kind
of error ended it."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..operations.operation import Result


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


def fault_of(error: Exception) -> str:
    """The kind of an error, as `library_errors` tells errors apart."""
    if isinstance(error, LookupError):
        return "not found"
    return "invalid" if isinstance(error, ValueError) else "storage"
