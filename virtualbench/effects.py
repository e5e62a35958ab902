"""The effects of the virtual bench: which of them act, and how strongly.

Strength 1 is the realistic, small default of the module that plays the effect, which says what it
means there; strength 0 is the same as off. An effect knows no physics here: this is the table of
switches.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

#: Every effect the bench can play. The names up to `sensor.` are the causes that a diagnosis
#: reports; those under `bench.` are habits of a bench that no diagnosis should take for a cause.
CATALOGUE: Mapping[str, str] = {
    "gun.back_pressure": "the atmosphere ahead of the "
    "projectile and the column of air it compresses",
    "gun.blow_by": "leakage through the clearance between projectile and barrel",
    "gun.valve_flow": "a valve of finite area that takes time to open",
    "gun.barrel_loss": "wall friction of the moving air column and drag, growing with speed",
    "gun.sliding_friction": "friction beyond the nominal: "
    "breakaway, Stribeck hump, seal pressed by the gas",
    "gun.heat_exchange": "heat between the gas and the walls",
    "gun.dead_volume": "volume between valve and projectile that fills before the shot moves",
    "contact.viscous_loss": "hysteresis of tip or target: force "
    "that depends on the rate of indentation",
    "contact.plastic_yield": "permanent indentation above a yield load",
    "contact.layer_compliance": "the insulating layer as a spring in series, where there is one",
    "contact.plate_compliance": "flexural waves that the plate carries away",
    "contact.effective_mass": "another mass behind the tip than the nominal one",
    "contact.tip_geometry": "a worn or pointed tip: another force over indentation",
    "plate.damping": "another modal damping than the table's",
    "plate.stiffness": "stiffness or thickness error: all frequencies scale",
    "plate.sensor_mass": "sensors load the plate where they sit",
    "plate.boundary": "stiffness of suspension or support",
    "sensor.pressure_offset": "offset of the tank-pressure transducer",
    "sensor.pressure_gain": "gain error of the tank-pressure transducer",
    "sensor.velocity_gain": "gain error of the velocity measurement",
    "sensor.force_gain": "gain error of the load cell",
    "sensor.force_bandwidth": "low-pass filter of the force channel",
    "sensor.acceleration_gain": "gain error of an accelerometer",
    "sensor.mount_resonance": "resonance of the accelerometer's mounting inside the band",
    "sensor.zero_shift": "offset of the accelerometer after the shock, decaying slowly",
    "bench.hand_scatter": "scatter of hand and bench from shot to shot",
    "bench.trigger_jitter": "the recorder's trigger comes a little early or late",
    "bench.drift": "slow drift of levels and gains over the day",
    "bench.noise": "noise of the measuring chain",
}

#: Errors that go either way: only their strength may be negative.
SIGNED = frozenset(
    {
        "contact.effective_mass",
        "contact.tip_geometry",
        "plate.damping",
        "plate.stiffness",
        "sensor.pressure_offset",
        "sensor.pressure_gain",
        "sensor.velocity_gain",
        "sensor.force_gain",
        "sensor.acceleration_gain",
        "sensor.zero_shift",
        "bench.drift",
    }
)


@dataclass(frozen=True)
class EffectSwitch:
    """One switch. Raises `ValueError` for an unknown name, a strength that is not finite, or one
    below 0 where the effect has no sign."""

    name: str
    on: bool = True
    strength: float = 1.0

    def __post_init__(self) -> None:
        if self.name not in CATALOGUE:
            raise ValueError(
                f"unknown effect {self.name!r}: expected one of {', '.join(CATALOGUE)}"
            )
        if not math.isfinite(self.strength):
            raise ValueError(
                f"strength of {self.name} = {self.strength!r}: expected a finite number"
            )
        if self.strength < 0 and self.name not in SIGNED:
            raise ValueError(
                f"strength of {self.name} = {self.strength!r}: expected 0 or "
                f"more, this effect has no sign"
            )

    @property
    def acting(self) -> float:
        """The strength with which it acts: 0.0 when off."""
        return float(self.strength) if self.on else 0.0


@dataclass(frozen=True)
class Effects(Mapping[str, float]):
    """A frozen mapping from every name of `CATALOGUE` to the strength with which it acts.

    Effects that are not given are off. Raises `ValueError` for an effect given twice, and for an
    unknown name wherever one is asked for.
    """

    given: tuple[EffectSwitch, ...] = ()

    def __post_init__(self) -> None:
        table = {effect.name: effect for effect in self.given}
        if len(table) < len(self.given):
            names = [effect.name for effect in self.given]
            raise ValueError(
                f"effects given twice: {sorted({name for name in names if names.count(name) > 1})}"
            )
        full = tuple(table.get(name, EffectSwitch(name, on=False)) for name in CATALOGUE)
        object.__setattr__(self, "given", full)

    @classmethod
    def default(cls) -> Effects:
        """The realistic bench: every effect at strength 1."""
        return cls(tuple(EffectSwitch(name) for name in CATALOGUE))

    @classmethod
    def none(cls) -> Effects:
        """The ideal bench: every effect off."""
        return cls()

    @classmethod
    def only(cls, name: str, strength: float = 1.0) -> Effects:
        """One effect on the ideal bench.

        Parameters:
            name: A name of `CATALOGUE`, such as "gun.blow_by".
            strength: How strongly it acts; by default 1, as on the realistic bench. Less than 0
                only for errors that go either way (`SIGNED`).

        Raises:
            ValueError: As `EffectSwitch` raises it.
        """
        return cls((EffectSwitch(name, strength=strength),))

    def with_strength(self, name: str, strength: float) -> Effects:
        """The same bench with one effect at another strength (and on).

        Parameters:
            name: A name of `CATALOGUE`, such as "gun.blow_by".
            strength: How strongly it acts: 1 as on the realistic bench, 0 not at all, and less than
                0 only for errors that go either way (`SIGNED`).

        Raises:
            ValueError: As `EffectSwitch` raises it.
        """
        return self._replaced(EffectSwitch(name, strength=strength))

    def without(self, *names: str) -> Effects:
        """The same bench with some effects off; they keep their strength for the seal.

        Parameters:
            names: Names of `CATALOGUE`, such as "gun.blow_by".

        Raises:
            ValueError: For an unknown name.
        """
        table = self
        for name in names:
            table = table._replaced(
                EffectSwitch(name, on=False, strength=table.effect(name).strength)
            )
        return table

    def effect(self, name: str) -> EffectSwitch:
        """The switch itself, with the strength it would have if it were on.

        Parameters:
            name: A name of `CATALOGUE`, such as "gun.blow_by".

        Raises:
            ValueError: For an unknown name.
        """
        for effect in self.given:
            if effect.name == name:
                return effect
        raise ValueError(f"unknown effect {name!r}: expected one of {', '.join(CATALOGUE)}")

    def as_json(self) -> dict[str, dict[str, Any]]:
        """What the seal keeps: name to `{"on": bool, "strength": float}`, in the catalogue's
        order."""
        return {
            effect.name: {"on": effect.on, "strength": float(effect.strength)}
            for effect in self.given
        }

    @classmethod
    def from_json(cls, table: Mapping[str, Mapping[str, Any]]) -> Effects:
        """The inverse of `as_json`.

        Parameters:
            table: Name to `{"on": bool, "strength": float}`; effects that it has not are off.

        Raises:
            ValueError: For keys other than `on` and `strength`, and as `EffectSwitch` raises it.
        """
        for name, row in table.items():
            if set(row) != {"on", "strength"}:
                raise ValueError(
                    f"effect {name!r} has the keys {sorted(row)}: expected 'on' and 'strength'"
                )
        return cls(
            tuple(
                EffectSwitch(name, bool(row["on"]), float(row["strength"]))
                for name, row in table.items()
            )
        )

    def __getitem__(self, name: str) -> float:
        return self.effect(name).acting

    def __contains__(self, name: object) -> bool:
        return name in CATALOGUE

    def __iter__(self) -> Iterator[str]:
        return iter(CATALOGUE)

    def __len__(self) -> int:
        return len(CATALOGUE)

    def _replaced(self, new: EffectSwitch) -> Effects:
        return Effects(tuple(new if effect.name == new.name else effect for effect in self.given))
