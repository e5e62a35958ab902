"""What every learned model asks of the inputs it is given."""

from __future__ import annotations

import numpy as np

from ...array_types import Floats
from ...dataset.table import Inputs, Predictor, Texts


def spelled(predictors: tuple[Predictor, ...]) -> Texts:
    """Names, units and levels as text (d,), to be stored beside what was learned from them."""
    return np.array([f"{p.name} [{p.unit}] {'|'.join(p.levels)}".strip() for p in predictors], dtype=np.str_)


def check_same_predictors(inputs: Inputs, learned: Texts) -> None:
    """Raises `ValueError` for other predictors than learned, by name, and for values that are not finite."""
    given = spelled(inputs.predictors)
    if not np.array_equal(given, learned):
        other = sorted(set(given.tolist()) ^ set(learned.tolist())) or ["their order"]
        raise ValueError(f"the model learned from other predictors; different: {', '.join(other)}")
    check_finite(inputs)


def check_finite(inputs: Inputs) -> None:
    """Raises `ValueError` with the predictor's name, its value and the row."""
    rows, columns = np.nonzero(~np.isfinite(inputs.x))
    if len(rows):
        name = inputs.predictors[columns[0]].name
        value = inputs.x[rows[0], columns[0]]
        raise ValueError(f"predictor {name!r} is {value} in row {rows[0]}: every predictor must be a finite number")


def momentum(inputs: Inputs) -> Floats:
    """The impactor's mass times its velocity (n,), kg m/s; the mass is a predictor (`bullet_mass`) or the bench's.

    Raises `ValueError` where either is unknown or not positive.
    """
    names = [predictor.name for predictor in inputs.predictors]
    mass = inputs.column("bullet_mass") if "bullet_mass" in names else inputs.impactor_mass_kg
    if not np.all(mass > 0):
        row = int(np.flatnonzero(~(mass > 0))[0])
        raise ValueError(
            f"the impactor's mass is {mass[row]} kg in row {row}: give it in campaign.toml, [bench.hammer] mass_kg"
        )
    velocity = inputs.column("impact_velocity")
    if not np.all(velocity > 0):
        row = int(np.flatnonzero(~(velocity > 0))[0])
        raise ValueError(
            f"predictor 'impact_velocity' is {velocity[row]} m/s in row {row}: an impact needs more than 0"
        )
    return np.asarray(mass * velocity)
