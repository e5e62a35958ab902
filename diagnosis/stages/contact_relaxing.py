"""What the law of a contact that relaxes leaves open."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...twin.contact.effects.viscous_loss import ViscousLoss
from ...twin.effects import Effect
from .base import Floats
from .contact_features import NAMES

#: What a pulse leans by.
_LEANING = ("rise_share", "skew", "shape_3")
#: Of what the law says of it.
_SPREAD = 1.0


def loose_relaxation(effects: Sequence[Effect], change: Floats) -> Floats | None:
    """(C, d) of a change (C, d): how much a pulse leans hangs on when within the contact the material relaxes.

    The law has one time of relaxation, far above the contact's; materials have many (Ferry, Viscoelastic Properties of
    Polymers, 1980, ch. 3), and lose the same energy with less or more of a lean.
    """
    if not any(isinstance(each, ViscousLoss) and _relaxes(each) for each in effects):
        return None
    leans = np.isin(NAMES, _LEANING)
    return np.asarray(_SPREAD * np.abs(change) * leans)


def _relaxes(effect: ViscousLoss) -> bool:
    return bool(np.any(np.asarray(effect.polymer_loss) > 0) or np.any(np.asarray(effect.relaxing_loss) > 0))
