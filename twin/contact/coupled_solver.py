"""What a contact stage takes that is solved on the modes of a plate, in place of the motion on a rigid target."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..contact_interface import ForcePulses
from .impacts import Impacts

#: Equidistant points of a pulse: more than a single contact needs, since the bodies may part and meet again.
COUPLED_PHASES = 129
#: Mean pulses, at so many phases, of some impacts and of the rows that they are of the stage's strikes.
ImpactSolver = Callable[[Impacts, NDArray[np.intp]], ForcePulses]
