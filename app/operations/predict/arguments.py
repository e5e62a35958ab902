"""Arguments of a prediction, as the library and the command line give them: a twin, effects, a
shot."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ....signals.valve_profile import ValveProfile
from ....twin.effects import Effect, effect
from ...common.frames import si
from ...twins.building import TwinRequest
from .predicting import NONE, ShotRequest

if TYPE_CHECKING:
    from ...common.frames import Quantity
    from ..diagnose.service import GapDiagnosis

    #: An effect of the catalogue: itself, its id, or "plate.damping:factor=2".
    EffectLike = Effect | str
    #: One, several, or a diagnosis, whose likeliest cause it is.
    EffectsLike = EffectLike | Iterable[EffectLike] | GapDiagnosis


#: How an argument is called where it was given: as Python spells it, or as an option of the command
#: line.
Label = Callable[[str], str]


def python_name(argument: str) -> str:
    """Arguments are called as Python spells them; the option `--effect` is repeated, the argument
    takes several."""
    return "effects" if argument == "effect" else argument


def option_name(argument: str) -> str:
    """An argument of the library as its option is spelled."""
    return f"--{argument.replace('_', '-')}"


def twin_request(
    label: Label,
    *,
    campaign: str | None = None,
    bench: str | os.PathLike[str] | None = None,
    modes: str | os.PathLike[str] | None = None,
    contact: str | None = None,
    effects: EffectsLike = (),
    plate: str | None = None,
    impact_points: Sequence[tuple[float, float]] = (),
    sensors: Sequence[tuple[float, float]] = (),
    q: float = 10.0,
    frequencies: str | Sequence[float] | None = None,
    adopted: bool = True,
    chain_height: Quantity = 0.0,
    coupled: bool = False,
) -> TwinRequest:
    """What a twin is made of. Raises `ValueError` and `LookupError` that call an argument as
    `label` does."""
    from ..impacts.spectra import checked_lines, parse_lines

    if not q > 0.5:
        raise ValueError(f"{label('q')} is {q!r}; expected a number above 0.5")
    name = label("frequencies")
    given = () if frequencies is None else frequencies
    lines = parse_lines(given, name) if isinstance(given, str) else checked_lines(given, name)
    return TwinRequest(
        campaign=campaign,
        modes=None if modes is None else Path(modes),
        bench=None if bench is None else Path(bench),
        contact=contact,
        effects=effects_of(effects, label("effect")),
        impact_points=tuple(impact_points),
        sensors=tuple(sensors),
        plate=plate,
        q=q,
        frequency_hz=tuple(lines.tolist()),
        adopted=adopted,
        chain_height_m=si(chain_height, "m", label("chain_height")),
        coupled=coupled,
    )


def shot_of(
    label: Label,
    *,
    tank_pressure: Quantity | None = None,
    velocity: Quantity | None = None,
    bullet_mass: Quantity | None = None,
    tip: str = "steel",
    tip_radius: Quantity = 0.045,
    anvil: str = NONE,
    insulator: str = NONE,
    impact_position: str = "#1",
    boundary_conditions: str | None = None,
    valve_profile: str | None = None,
    factors: Mapping[str, float | str] | None = None,
) -> ShotRequest:
    """A shot in SI. Raises `ValueError` that calls an argument as `label` does."""

    def optional(value: Quantity | None, si_unit: str, argument: str) -> float | None:
        return None if value is None else si(value, si_unit, label(argument))

    if velocity is not None and tank_pressure is not None:
        raise ValueError(f"{label('velocity')} and {label('tank_pressure')}: expected one of them")
    return ShotRequest(
        bullet_mass_kg=optional(bullet_mass, "kg", "bullet_mass"),
        tip_material=tip,
        tip_radius_m=si(tip_radius, "m", label("tip_radius")),
        tank_pressure_pa=optional(tank_pressure, "Pa", "tank_pressure"),
        impact_velocity_m_s=optional(velocity, "m/s", "velocity"),
        anvil_material=anvil,
        insulator=insulator,
        impact_position=impact_position,
        boundary_conditions=boundary_conditions,
        factors=dict(factors or {}),
        valve_profile=_profile(valve_profile),
    )


def _profile(text: str | None) -> str | None:
    """A profile as typed, or of the file that is named. Raises `ValueError`."""
    if text is None:
        return None
    return str(
        ValveProfile.parse(text)
        if ":" in text and not Path(text).exists()
        else ValveProfile.read(Path(text))
    )


def effects_of(given: EffectsLike, name: str) -> tuple[Effect, ...]:
    """Effects as objects. Raises as `parse_effect`, and `ValueError` for a diagnosis that names no
    effect."""
    from ..diagnose.service import GapDiagnosis

    if isinstance(given, GapDiagnosis):
        verdict = given.verdict
        if not verdict.first.fitted:
            first, fits = " or ".join(verdict.first.effects), ", ".join(given.fitted) or "nothing"
            raise ValueError(
                f"the likeliest cause in the diagnosis of {verdict.campaign} is {first}, which has "
                f"no effect to add; its attribute `fitted` has: {fits}"
            )
        return verdict.first.fitted
    listed = [given] if isinstance(given, str | Effect) else given
    return tuple(
        parse_effect(effect, name) if isinstance(effect, str) else effect for effect in listed
    )


def parse_effect(text: str, name: str) -> Effect:
    """The effect with its parameters in SI.

    Raises `LookupError` for an effect that the catalogue does not have, and `ValueError` that says
    `name`, the argument or option, for a value that is no number.
    """
    identity, _, rest = text.partition(":")
    values: dict[str, float] = {}
    for part in filter(None, rest.split(",")):
        parameter, _, number = part.partition("=")
        try:
            values[parameter.strip()] = float(number)
        except ValueError as error:
            raise ValueError(
                f"{name} {text!r}: {part!r}; expected NAME=VALUE in SI, such as gain=1.02"
            ) from error
    return effect(identity.strip(), **values)
