"""Numbers that JSON has not."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any


def finite(value: Any) -> Any:
    """Plain data with null for NaN and infinities, lists for tuples."""
    if isinstance(value, float):  # first: most of what is asked is numbers
        return float(value) if math.isfinite(value) else None
    if isinstance(value, list | tuple):
        return [finite(element) for element in value]
    if isinstance(value, Mapping):
        return {key: finite(element) for key, element in value.items()}
    return value
