"""Hysteresis of tip or target: a force that grows with the rate of indentation."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from ....array_types import Floats
from ...effects import Value, parameter
from ..hertz import matched_damping, restitution_of
from ..impacts import ContactEffect, Impacts


@dataclass(frozen=True)
class ViscousLoss(ContactEffect):
    """chi is the material's: faster impacts lose more, e = 1 - (2/3) chi u for small losses (eq.
    1.19).

    Polymers relax: within an impact they are stiffer than at rest, and lose a share that hardly
    hangs on speed. There the contact is a stiffer spring with a dashpot in series, as Maxwell's
    body, with Zener's inelasticity (`polymer_loss`); it acts by the polymers' share of the
    contact's compliance. `relaxing_loss` and `relaxing_stiffening` do the same to a contact of any
    materials.
    """

    id: ClassVar[str] = "contact.viscous_loss"
    law: ClassVar[str] = (
        "F = k delta^p (1 + chi x'); polymers: k' = (1 + s) k, x' = v - lambda l F / (m u)"
    )
    source: ClassVar[str] = (
        "Hunt and Crossley, J. Appl. Mech. 42 (1975) 440; thesis, eq. 1.18 to 1.21; polymers: Lee "
        "and Radok, J. Appl. Mech. 27 (1960) 438"
    )

    # up to a restitution of 0.35 at 1 m/s, of soft polymers (Goldsmith, Impact, 1960, ch. 8);
    # metals stay below 0.2
    loss_s_m: Value = parameter(
        "chi, loss for the rate of indentation",
        "s/m",
        default=0.1,
        low=0,
        high=50,
        off=0,
        likely=(0, 3),
        owner="tip",
    )

    # polyurethane rebounds at 0.6, e = exp(-1.72 lambda) after Zener; half of that again for filled
    # rubbers
    polymer_loss: Value = parameter(
        "lambda, inelasticity of polymers that relax",
        "",
        default=0,
        low=0,
        high=2,
        off=0,
        likely=(0, 0.8),
        owner="tip",
    )
    # dynamic over static modulus less one: 0.1 to 1 for engineering polymers, several for
    # elastomers near their glass transition (Ferry, Viscoelastic Properties of Polymers, 1980)
    polymer_stiffening: Value = parameter(
        "s, by which polymers are stiffer than at rest",
        "",
        default=0,
        low=0,
        high=10,
        off=0,
        likely=(0, 5),
        owner="tip",
    )
    # the same of whatever meets: joints, coatings and grease relax where no polymer is
    relaxing_loss: Value = parameter(
        "lambda, inelasticity of any contact that relaxes",
        "",
        default=0,
        low=0,
        high=2,
        off=0,
        likely=(0, 0.5),
        owner="tip",
    )
    relaxing_stiffening: Value = parameter(
        "s, by which any contact is stiffer than at rest",
        "",
        default=0,
        low=0,
        high=10,
        off=0,
        likely=(0, 1),
        owner="tip",
    )
    regimes: ClassVar[tuple[tuple[str, ...], ...]] = (
        ("loss_s_m",),
        ("polymer_loss", "polymer_stiffening"),
        ("relaxing_loss", "relaxing_stiffening"),
    )

    @classmethod
    def of_restitution(cls, restitution: Value, impact_velocity_m_s: Value) -> Self:
        """The loss with which impacts of this velocity end with this restitution, in [0.01, 1]."""
        e, velocity = np.broadcast_arrays(np.atleast_1d(restitution), impact_velocity_m_s)
        return cls(matched_damping(np.asarray(e, dtype=np.float64)) / velocity)

    def restitution(self, impact_velocity_m_s: Floats) -> Floats:
        """With which impacts (n,) end where nothing else loses energy, whatever the exponent and
        the layer."""
        return restitution_of(np.asarray(self.loss_s_m * impact_velocity_m_s, dtype=np.float64))

    def prepare(self, impacts: Impacts) -> Impacts:
        share = _polymers(impacts)
        loss = share * self._each(self.polymer_loss, impacts) + self._each(
            self.relaxing_loss, impacts
        )
        stiffer = (1 + share * self._each(self.polymer_stiffening, impacts)) * (
            1 + self._each(self.relaxing_stiffening, impacts)
        )
        stiffness = impacts.stiffness_n_mp * stiffer
        momentum = impacts.mass_kg * impacts.bodies.impact_velocity_m_s
        length = (momentum * impacts.bodies.impact_velocity_m_s / stiffness) ** (
            1 / (impacts.exponent + 1)
        )
        return replace(
            impacts,
            rate_loss_s_m=impacts.rate_loss_s_m + self._each(self.loss_s_m, impacts),
            stiffness_n_mp=stiffness,
            plate_mobility_m_n_s=impacts.plate_mobility_m_n_s + loss * length / momentum,
        )


#: Below this modulus a material is taken for a polymer.
_POLYMER_PA = 20e9


def _polymers(impacts: Impacts) -> Floats:
    """Their share of the contact's compliance, (n,)."""
    of = impacts.bodies
    tip = (1 - of.impactor_poisson_ratio**2) / of.impactor_youngs_modulus_pa
    face = (1 - of.target_poisson_ratio**2) / of.target_youngs_modulus_pa
    soft = tip * (of.impactor_youngs_modulus_pa < _POLYMER_PA) + face * (
        of.target_youngs_modulus_pa < _POLYMER_PA
    )
    return np.asarray(soft / (tip + face))
