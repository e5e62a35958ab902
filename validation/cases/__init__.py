"""Withheld campaigns: folders whose cause is drawn, played by the virtual bench and sealed, to
check a diagnosis blind.

The bench of a case is the ideal one, with the drawn effects, a small background that no effect
explains, and noise:

    case = draw_case("gun", "strong", np.random.default_rng(1))
    label = record_case(case, folder, seed=2)
"""

from .case import KINDS, TIERS, TOLERANCES, Case, Label
from .draw import draw_case
from .record import label_of, new_key, open_labels, publish, record_case, seal_labels
from .unknowns import FAMILIES, families

__all__ = [
    "FAMILIES",
    "KINDS",
    "TIERS",
    "TOLERANCES",
    "Case",
    "Label",
    "draw_case",
    "families",
    "label_of",
    "new_key",
    "open_labels",
    "publish",
    "record_case",
    "seal_labels",
]
