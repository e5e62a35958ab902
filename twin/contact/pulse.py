"""What a law of contact gives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...array_types import Floats
from .bodies import Bodies
from .restitution_laws import Restitution

#: Force over peak at phases (p,) of the contact, as n x p or 1 x p.
Shape = Callable[[Floats], Floats]


@dataclass(frozen=True, eq=False)
class ContactPulse:
    """Force pulses of n impacts; arrays are (n,).

    `compression_time_s` ends at the deepest indentation. `impulse_n_s` is the law's own, in closed
    form. `restitution` is what the law was given, and says where that had to be clipped; 1 for laws
    without loss.
    """

    contact_time_s: Floats
    compression_time_s: Floats
    peak_force_n: Floats
    impulse_n_s: Floats
    restitution: Restitution
    shape: Shape

    def force_at(self, phase: Floats) -> Floats:
        """Force (N, (n, p)), without force exactly at begin and end of the contact.

        Parameters:
            phase: Phases of the contact (p,), 0 its begin and 1 its end.

        Raises:
            ValueError: For a phase outside of [0, 1].
        """
        if not np.all((phase >= 0) & (phase <= 1)):
            raise ValueError(
                f"phases from {np.min(phase):g} to {np.max(phase):g}: expected all in [0, 1]"
            )
        inside = (phase > 0) & (phase < 1)
        return np.where(inside, self.peak_force_n[:, None] * self.shape(phase), 0.0)

    def force_n(self, points: int = 20) -> Floats:
        """Force (N, (n, points)) at equidistant instants of the contact, both ends included.

        Parameters:
            points: Number of instants; 20 by default.
        """
        return self.force_at(np.linspace(0.0, 1.0, points))


#: A nominal law of contact. Raises `MissingQuantityError` for bodies that do not tell what it
#: needs.
Law = Callable[[Bodies], ContactPulse]
