"""Where models may differ: labels of pulses by what lies in a contact."""

from __future__ import annotations

import numpy as np

from ..dataset.table import Inputs, PulseTable, Texts

#: From slow to fast, a third of the pulses each.
SPEEDS = ("slow", "middle", "fast")


def comparison_groups(pulses: PulseTable) -> dict[str, Texts]:
    """Labels (n,) by tip, target, every predictor that is a category, and tercile of the impact velocity.

    Groupings with one label only are left out: they tell nothing that all pulses together do not.
    """
    named: dict[str, Texts] = {"tip_material": pulses.tip_material, "target_material": pulses.target_material}
    named |= {p.name: level_names(pulses, p.name) for p in pulses.predictors if p.levels}
    named["impact_velocity"] = speed_terciles(pulses)
    return {name: labels for name, labels in named.items() if len(np.unique(labels)) > 1}


def level_names(inputs: Inputs, name: str) -> Texts:
    """The levels (n,) of a category by their names. Raises `LookupError` for one that is none."""
    levels = next((p.levels for p in inputs.predictors if p.name == name), ())
    if not levels:
        raise LookupError(f"predictor {name!r} has no levels")
    return np.array(levels)[inputs.column(name).astype(np.int64)]


def speed_terciles(inputs: Inputs) -> Texts:
    """Slow, middle or fast (n,), by thirds of these impacts."""
    velocity = inputs.column("impact_velocity")
    return np.array(SPEEDS)[np.searchsorted(np.quantile(velocity, [1 / 3, 2 / 3]), velocity)]
