"""Models made of parts: copies that learn, and their arrays under names with a prefix."""

from __future__ import annotations

import copy
from typing import Any, TypeVar

from ..estimators.base import Arrays, Estimator
from .base import ContactModel

_P = TypeVar("_P", Estimator, ContactModel)


def own(part: _P) -> _P:
    """A copy to learn with: what the constructor was given stays as it was given."""
    return copy.deepcopy(part)


def prefixed(prefix: str, arrays: Arrays) -> Arrays:
    return {f"{prefix}.{name}": array for name, array in arrays.items()}


def restored(part: _P, prefix: str, arrays: Arrays) -> _P:
    """A copy of the part that has learned what stands under the prefix."""
    begin = f"{prefix}."
    own_arrays = {name.removeprefix(begin): array for name, array in arrays.items() if name.startswith(begin)}
    return own(part).restore(own_arrays)


def taken(arrays: Arrays, name: str, kind: str) -> Any:
    """One array. Raises `ValueError` where it is missing."""
    if name not in arrays:
        raise ValueError(f"a model of kind {kind!r} is restored from arrays with {name!r}, which is missing")
    return arrays[name]
