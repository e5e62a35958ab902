"""What the row of a job holds: its data alone, or beside them the whole result for clients of
another machine, and which kind of error ended it."""

from __future__ import annotations

from typing import Any

_DATA, _WHOLE, _FAULT = "~data", "~result", "~fault"


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
