"""Lines of a spectrum as text."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

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
        said = f" ({error})" if "expected" in str(error) else ""
        raise ValueError(
            f"{name} is {text!r}{said}; expected Hz as 100,200,500 or low:high:per_octave as 100:10000:6"
        ) from error
    if not np.all(np.isfinite(lines) & (lines > 0)):
        raise ValueError(f"{name} is {text!r}; expected positive numbers, in Hz")
    return np.unique(lines)
