"""Lines of a spectrum as text."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...signals.srs.grid import octave_grid


def parse_lines(text: str, name: str) -> NDArray[np.float64]:
    """`100,200,500` or `100:10000:6` (low:high:lines per octave, 6 by default), in Hz.

    Raises `ValueError` that says `name`, the argument or option.
    """
    try:
        if ":" in text:
            low, high, *per_octave = text.split(":")
            return octave_grid(float(low), float(high), *(int(number) for number in per_octave))
        lines = np.asarray([float(number) for number in text.split(",")])
    except (ValueError, TypeError) as error:
        reason = f" ({error})" if "expected" in str(error) else ""
        raise ValueError(
            f"{name} is {text!r}{reason}; expected Hz as 100,200,500 or low:high:per_octave as 100:10000:6"
        ) from error
    return checked_lines(lines, name)


def checked_lines(lines: ArrayLike, name: str) -> NDArray[np.float64]:
    """The lines in Hz, rising, each once. Raises `ValueError` that says `name` for what is not positive."""
    values = np.asarray(lines, dtype=np.float64)
    if values.ndim != 1 or not np.all(np.isfinite(values) & (values > 0)):
        raise ValueError(f"{name} is {values.tolist()}; expected positive numbers, in Hz")
    return np.unique(values)
