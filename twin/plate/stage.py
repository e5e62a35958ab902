"""The stage of the plate: nominal modes, effects, what is not known of them, and answers that are
kept."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from ...array_types import Floats
from ..effects import Effect
from ..prediction import stratified_normals
from .modal import ModalPlate

#: Of the ensemble's random numbers: the same plates in every process.
_SEED = 1


@dataclass(frozen=True)
class PlateSpread:
    """What is not known of a plate: one factor on all frequencies and one on all dampings, both
    log-normal.

    Defaults are assumed: a finite element model with handbook elasticity and a plate measured to
    0.1 mm of 10 mm is within some per cent of a free plate's frequencies; damping of bolted and
    hung structures scatters by half about a value that is not measured. `members` is the size of
    the ensemble of plates; 0 for a plate that is known.
    """

    frequency: float = 0.01
    damping: float = 0.4
    members: int = 8

    def __post_init__(self) -> None:
        if not (0 <= self.frequency < 0.5 and 0 <= self.damping < 2 and self.members >= 0):
            raise ValueError(
                f"{self}: expected frequency in [0, 0.5), damping in [0, 2), members of 0 or more"
            )


@dataclass(frozen=True, eq=False)
class PlateStage:
    """Plates by the name of their material, all with the same sensors. `label` says where the modes
    are from.

    Raises `ValueError` where the plates' sensors differ, `TypeError` for effects of another stage.
    """

    plates: Mapping[str, ModalPlate]
    effects: tuple[Effect, ...] = ()
    spread: PlateSpread = field(default_factory=PlateSpread)
    label: str = "modes"
    _ensembles: dict[str, tuple[ModalPlate, ...]] = field(
        default_factory=dict, init=False, repr=False
    )

    def __post_init__(self) -> None:
        if len({plate.sensors for plate in self.plates.values()}) > 1:
            sensor_lists = "; ".join(
                f"{name}: {', '.join(plate.sensors)}" for name, plate in self.plates.items()
            )
            raise ValueError(f"plates with different sensors: {sensor_lists}")
        for name in self.plates:
            self.ensemble(name)

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names; none without a plate."""
        return next((plate.sensors for plate in self.plates.values()), ())

    @property
    def band_hz(self) -> float:
        """Up to here accelerations have content: the highest mode of all plates; 0 without a
        plate."""
        highest = (float(plate.frequency_hz.max(initial=0.0)) for plate in self.plates.values())
        return max(highest, default=0.0)

    @property
    def members(self) -> int:
        """How many plates are drawn from."""
        return self.spread.members

    def ensemble(self, name: str) -> tuple[ModalPlate, ...]:
        """The plate itself, then those that it may be as well.

        Parameters:
            name: Name of the plate's material, as in `plates`.

        Raises:
            LookupError: For a plate there is none of; the message names those there are.
        """
        if name not in self.plates:
            raise LookupError(
                f"no modes of a plate of {name!r}; there are: {', '.join(self.plates) or 'none'}"
            )
        if name not in self._ensembles:
            from .modal import with_effects

            plate = with_effects(self.plates[name], self.effects)
            self._ensembles[name] = (
                plate,
                *(_other(plate, *factors) for factors in self._factors()),
            )
        return self._ensembles[name]

    def _factors(self) -> Floats:
        """Of frequency and damping, (members, 2)."""
        z = (
            stratified_normals(self.members, 2, np.random.default_rng(_SEED))
            if self.members
            else np.zeros((0, 2))
        )
        return np.asarray(np.exp(z * (self.spread.frequency, self.spread.damping)))


def _other(plate: ModalPlate, frequency: float, damping: float) -> ModalPlate:
    return replace(
        plate,
        frequency_hz=plate.frequency_hz * frequency,
        damping_ratio=np.minimum(plate.damping_ratio * damping, math.nextafter(1.0, 0.0)),
    )
