"""The nominal laws of contact as models: what physics says without having seen a pulse."""

from __future__ import annotations

from typing import Any, ClassVar, Self

import numpy as np

from ...array_types import Floats
from ...dataset.table import POINTS, Inputs, PulseTable, Texts
from ...twin.contact.bodies import Bodies, MissingQuantityError
from ...twin.contact.laws import contact_law
from ...twin.contact.pulse import ContactPulse
from ..estimators.base import Arrays, NotFittedError
from .base import ContactModel, ContactPrediction, check_same_predictors, get_array, spelled

#: Quantity of the bodies: predictor (Table 4.3).
_COLUMNS = {
    "impactor_radius_m": "tip_radius",
    "impactor_youngs_modulus_pa": "tip_youngs_modulus",
    "impactor_poisson_ratio": "tip_poisson_ratio",
    "impactor_density_kg_m3": "tip_density",
    "impactor_yield_strength_pa": "tip_yield_strength",
    "target_youngs_modulus_pa": "plate_youngs_modulus",
    "target_poisson_ratio": "plate_poisson_ratio",
    "target_density_kg_m3": "plate_density",
    "target_yield_strength_pa": "plate_yield_strength",
    "impact_velocity_m_s": "impact_velocity",
}
_MASS = "bullet_mass"
_AGAIN = "of campaign.toml (one that is stored already goes in under another name)"
_WHERE = {
    "impactor_mass_kg": f"give mass_kg in [bench.hammer] "
    f"{_AGAIN}, or ask with a predictor bullet_mass",
    "plate_thickness_m": f"give material and thickness_m in [bench.plate] {_AGAIN}",
}


class Analytic(ContactModel):
    """A law of contact by name, and of restitution where it loses energy (None: Zener's). It learns
    nothing.

    The target is the first layer hit; insulator and boundary conditions have no part in these laws.
    Raises `LookupError` for a law there is none of, `ValueError` for a restitution of a law without
    loss.
    """

    kind: ClassVar[str] = "analytic"

    def __init__(self, law: str, restitution: str | None = None) -> None:
        self.law = law
        self.restitution = restitution
        contact_law(law, restitution)

    # Nothing is left to chance.
    def fit(self, pulses: PulseTable, rng: np.random.Generator) -> Self:  # noqa: ARG002
        """Keeps the predictors, so as to refuse others later, and nothing else of the pulses."""
        self.predictors_ = spelled(pulses.predictors)
        return self

    def predict(self, inputs: Inputs) -> ContactPrediction:
        """No spread. Raises `ValueError` also where the law needs a mass or a thickness that is not
        known."""
        pulse = self.pulse(inputs)
        return ContactPrediction(pulse.force_n(POINTS), pulse.contact_time_s, None, None)

    def pulse(self, inputs: Inputs) -> ContactPulse:
        """The law's own pulse: at any phase, and with the restitution it took. Raises as `predict`
        does."""
        check_same_predictors(inputs, self._fitted())
        try:
            return contact_law(self.law, self.restitution)(bodies(inputs))
        except MissingQuantityError as missing:
            raise ValueError(f"{missing}: {_WHERE[missing.quantity]}") from missing

    def settings(self) -> dict[str, Any]:
        return {"law": self.law, "restitution": self.restitution}

    def arrays(self) -> Arrays:
        return {"predictors": self._fitted()}

    def restore(self, arrays: Arrays) -> Self:
        self.predictors_ = get_array(arrays, "predictors", self.kind)
        return self

    def _fitted(self) -> Texts:
        if not hasattr(self, "predictors_"):
            raise NotFittedError(
                f"{self.law} is asked before it was fitted: fit it to a table of pulses"
            )
        return self.predictors_


def bodies(inputs: Inputs) -> Bodies:
    """The bodies of n impacts; a bullet's mass is the predictor `bullet_mass` where there is one.

    Raises `LookupError` for predictors that are missing, `ValueError` for values that are
    unphysical.
    """
    varied = any(predictor.name == _MASS for predictor in inputs.predictors)
    mass = inputs.column(_MASS) if varied else inputs.impactor_mass_kg
    return Bodies.of(
        **{quantity: inputs.column(name) for quantity, name in _COLUMNS.items()},
        impactor_mass_kg=_finite_or_none(mass),
        plate_thickness_m=_finite_or_none(inputs.plate_thickness_m),
    )


def _finite_or_none(values: Floats) -> Floats | None:
    return None if np.any(np.isnan(values)) else values
