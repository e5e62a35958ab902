"""Parameters of the contact of which only a likely range is known before anything was measured."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...array_types import Floats
from ..setting import Setting
from .effects.effective_mass import EffectiveMass
from .effects.layer_compliance import LayerCompliance
from .effects.plastic_yield import PlasticYield
from .effects.plate_compliance import PlateCompliance
from .effects.viscous_loss import ViscousLoss
from .impacts import ContactEffect

#: Below this modulus a material is a polymer: it relaxes, where a metal's loss grows with the rate.
_POLYMER_PA = 20e9
#: Standard deviations from the middle of a likely range to either end.
_DEVIATIONS = 2.0
#: Standard deviations beyond which a parameter goes no further.
_FARTHEST = 5.0


@dataclass(frozen=True)
class UncertainParameter:
    """A log-normal parameter: the likely range, of which `low` is the least value that matters, is
    two standard deviations to either side of its geometric mean.

    `level` names what it belongs to (a tip, a plate) at a setting; two levels share `shared` of the
    variance of the logarithm. `shot_variance` is the share of it that is new with each shot.
    `effect` is None for the bench's parts, which are no effect of the catalogue.
    """

    effect: type[ContactEffect] | None
    name: str
    low: float
    high: float
    level: Callable[[Setting], str]
    shared: float
    shot_variance: float = 0.0

    def values(self, z: Floats) -> Floats:
        """Of standard normal numbers, any shape; within the range that the effect allows."""
        deviation = math.log(self.high / self.low) / (2 * _DEVIATIONS)
        values = math.sqrt(self.low * self.high) * np.exp(
            deviation * np.clip(z, -_FARTHEST, _FARTHEST)
        )
        if self.effect is None:
            return np.asarray(values)
        allowed = next(item for item in self.effect.parameters() if item.name == self.name)
        return np.clip(values, allowed.low, allowed.high)


def polymeric(setting: Setting) -> bool:
    """Whether one of the bodies that meet is a polymer."""
    return min(setting.tip.youngs_modulus_pa, setting.target.youngs_modulus_pa) < _POLYMER_PA


def _tip(setting: Setting) -> str:
    return setting.tip.name


def _plate(setting: Setting) -> str:
    return f"{setting.plate.name} {setting.plate_thickness_m:g}"


def _layer(setting: Setting) -> str:
    return setting.insulator


def _anvil(setting: Setting) -> str:
    return setting.target.name


def _hammer(_: Setting) -> str:
    return "hammer"


#: The ranges are those of the effects' catalogue; a range that begins at 0 there begins here at
#: what is noticed.
YIELD = UncertainParameter(PlasticYield, "pressure_over_yield_strength", 0.3, 20.0, _tip, 0.5)
#: Of metals, which stay below 0.2 s/m.
METAL_LOSS = UncertainParameter(ViscousLoss, "loss_s_m", 1e-3, 0.2, _tip, 0.5)
POLYMER_LOSS = UncertainParameter(ViscousLoss, "polymer_loss", 0.05, 0.8, _tip, 0.5)
POLYMER_STIFFENING = UncertainParameter(ViscousLoss, "polymer_stiffening", 0.05, 5.0, _tip, 0.5)
PLATE_SHARE = UncertainParameter(PlateCompliance, "share", 0.05, 3.0, _plate, 0.7)
LAYER = UncertainParameter(LayerCompliance, "compliance_m_n", 1e-9, 1e-6, _layer, 0.5)
#: Stiffness doubles between 0.1 and 10 kN.
LAYER_STIFFENING = UncertainParameter(LayerCompliance, "stiffening_1_n", 1e-4, 1e-2, _layer, 0.5)
#: Of a hammer in a hand, whose grip differs a little from blow to blow.
HAND_MASS = UncertainParameter(
    EffectiveMass, "mass_factor", 0.5, 3.0, _hammer, 1.0, shot_variance=0.01
)

#: An anvil of aluminium between 0.1 and 3 kg, bolted on: dry metal faces give way by micrometres
#: under a few kN.
ANVIL_VOLUME = UncertainParameter(None, "anvil_volume_m3", 4e-5, 1e-3, _anvil, 0.9)
JOINT = UncertainParameter(None, "joint_stiffness_n_m", 2e8, 2e10, _anvil, 0.9)

#: Columns of standard normal numbers by name: a metal's loss and a polymer's are the same column of
#: different levels.
COLUMNS: Mapping[str, tuple[UncertainParameter, ...]] = {
    "mass": (HAND_MASS,),
    "yield": (YIELD,),
    "loss": (METAL_LOSS, POLYMER_LOSS),
    "stiffening": (POLYMER_STIFFENING,),
    "plate": (PLATE_SHARE,),
    "layer": (LAYER,),
    "layer_stiffening": (LAYER_STIFFENING,),
    "anvil": (ANVIL_VOLUME,),
    "joint": (JOINT,),
}


def effect_of(name: str) -> str | None:
    """Id of the effect whose parameter a column is; None for what is no effect's."""
    effect = COLUMNS[name][0].effect if name in COLUMNS else None
    return None if effect is None else effect.id


def uncertain_columns(fixed: Collection[str], hand_held: bool) -> tuple[str, ...]:
    """Names of the columns that are drawn where the effects of these ids are fixed."""
    return tuple(
        name for name in COLUMNS if effect_of(name) not in fixed and (hand_held or name != "mass")
    )


def drawn_effects(
    latent: Mapping[str, Floats], polymer: np.ndarray[tuple[int], np.dtype[np.bool_]]
) -> list[ContactEffect]:
    """Effects with parameters (n,) of the columns (n,) that there are. `polymer` (n,): where a
    polymer meets."""
    effects: list[ContactEffect] = []
    if "mass" in latent:
        effects.append(EffectiveMass(HAND_MASS.values(latent["mass"])))
    if "yield" in latent:
        effects.append(PlasticYield(YIELD.values(latent["yield"])))
    if "loss" in latent:
        effects.append(
            ViscousLoss(
                loss_s_m=np.where(polymer, 0.0, METAL_LOSS.values(latent["loss"])),
                polymer_loss=POLYMER_LOSS.values(latent["loss"]),
                polymer_stiffening=POLYMER_STIFFENING.values(latent["stiffening"]),
            )
        )
    if "plate" in latent:
        effects.append(PlateCompliance(PLATE_SHARE.values(latent["plate"])))
    if "layer" in latent:
        effects.append(
            LayerCompliance(
                LAYER.values(latent["layer"]), LAYER_STIFFENING.values(latent["layer_stiffening"])
            )
        )
    return effects


def column_correlation(name: str, rows: Sequence[Setting], columns: Sequence[Setting]) -> Floats:
    """Prior correlation (rows, columns) of a column's normal numbers at two lots of settings, but
    for what is new with each shot."""
    parameter = COLUMNS[name][0]
    first, second = (
        np.array([parameter.level(setting) for setting in lot]) for lot in (rows, columns)
    )
    same = first[:, None] == second
    correlation = parameter.shared + (1 - parameter.shared) * same
    if len(COLUMNS[name]) > 1:  # a metal's loss says nothing of a polymer's
        kinds = [np.array([polymeric(setting) for setting in lot]) for lot in (rows, columns)]
        correlation = correlation * (kinds[0][:, None] == kinds[1])
    return np.asarray(correlation * (1 - parameter.shot_variance))


def shot_variance(name: str) -> float:
    """The share of a column's variance that is new with each shot."""
    return COLUMNS[name][0].shot_variance
