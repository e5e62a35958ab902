"""What every way of designing a campaign gives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..space import Space


@dataclass(frozen=True)
class Design:
    """Treatments (n, axes) of a space, as indices along its axes, in order of run.

    `method` is stored with a plan ("lhs", "factorial", "import", ...); `seed` is None where nothing was drawn.
    Raises `ValueError` where a row is no treatment of the space.
    """

    space: Space
    treatments: NDArray[np.int64]
    method: str
    seed: int | None

    def __post_init__(self) -> None:
        object.__setattr__(self, "treatments", self.space.checked(self.treatments))

    @property
    def rows(self) -> list[dict[str, str]]:
        """Column to level for each run."""
        return self.space.rows(self.treatments)
