"""Numbers that no sensor gives, in any unit."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .readers import RecordingError

#: Beyond it products of three samples overflow, and every figure after them.
LARGEST = 1e100


def refuse_no_reading(file: str, channel: str, samples: NDArray[Any]) -> None:
    """Raises `RecordingError` for a finite sample beyond `LARGEST`: the file is damaged, or has another type."""
    if samples.dtype.kind != "f" or samples.dtype.itemsize < 8:
        return
    beyond = (np.abs(samples) > LARGEST) & np.isfinite(samples)
    if beyond.any():
        at = int(np.argmax(beyond))
        raise RecordingError(
            f"{file}: channel {channel!r} holds {samples[at]:.3g} at sample {at}; no sensor gives such a number, "
            "the file is damaged or has another type of number"
        )
