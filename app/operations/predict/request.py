"""What is asked of a prediction: the shot, the twin that predicts it, and the draws of bands."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, ValidationInfo, field_validator

from ....schema.known_factors import BY_NAME, checked_chain_height
from ..fields import (
    Presentation,
    Seed,
    TextFile,
    pairs,
    quantity,
    request_field,
    source_of,
    text_file,
)
from ..operation import Request
from ..twin_fields import TwinFields, Word
from .factors import Value, factor_value

if TYPE_CHECKING:
    from ....twin.effects import Effect
    from ....twin.setting import Setting
    from ...twins.benches import Bench
    from ...twins.building import BuiltTwin, TwinRequest
    from ..diagnose.service import GapDiagnosis

    #: An effect of the catalogue: itself, its id, or "plate.damping:factor=2".
    EffectLike = Effect | str
    #: One, several, or a diagnosis, whose likeliest cause it is.
    EffectsLike = EffectLike | Iterable[EffectLike] | GapDiagnosis

NONE = "none"
#: Gauge, where neither pressure nor velocity is said.
TANK_PRESSURE_PA = 5e5
#: Random shots for the bands.
DRAWS = 64
#: A table of shots from another machine has so many bytes at most: the answer is waited for.
_MOST_NETWORK_BYTES = 100_000
#: So many draws are answered within a second.
_MOST_NETWORK_DRAWS = 1024
#: Factors of the thesis that are given by fields of their own, or whose part the velocity takes.
_OWN_FIELDS = frozenset(BY_NAME) - {"hammer_speed"}


def _option(name: str, metavar: str, completion: str = "") -> Presentation:
    """A field whose name has its unit or its noun, where commands and Python keep a shorter one."""
    argument = name.replace("-", "_")
    return Presentation(metavar=metavar, completion=completion, option=name, argument=argument)


def _quantity(default: float | None, option: str, example: str, help: str) -> Any:
    """A number with a unit; without one it is SI where the name of its field says so."""
    shown = _option(option, example)
    return request_field(default, help=help, example=example, presentation=shown)


def _factor(field_name: str, name: str, value: Any) -> Value:
    if name in _OWN_FIELDS:
        raise ValueError(
            f"{field_name} {name}={value}: {name} has an option of its own, "
            f"--{name.replace('_', '-')}"
        )
    if value == "":
        raise ValueError(f"{field_name} {name!r}; expected NAME=VALUE, such as plate_mass_kg=9.3")
    return factor_value(value) if isinstance(value, str) else float(value)


def _valve_profile(value: Any, info: ValidationInfo) -> Any:
    """A profile as typed, or of the file that is named on this machine."""
    from ....signals.valve_profile import ValveProfile

    if not isinstance(value, str | Path) or value == "":
        return value or None
    text = str(value)
    named = source_of(info) in ("command", "python") and (":" not in text or Path(text).exists())
    return str(ValveProfile.read(Path(text)) if named else ValveProfile.parse(text))


_Pressure: Any = Annotated[quantity("Pa", named=True), Field(ge=1, le=1e8)]
_Velocity: Any = Annotated[quantity("m/s", named=True), Field(ge=1e-3, le=1e4)]
_Mass: Any = Annotated[quantity("kg", named=True), Field(ge=1e-4, le=1e3)]
_Radius: Any = Annotated[quantity("m", named=True), Field(ge=1e-5, le=10)]
_Height: Any = Annotated[
    quantity("m", named=True), Field(ge=-10, le=10), AfterValidator(checked_chain_height)
]
_ValveProfile = Annotated[str, BeforeValidator(_valve_profile), Field(max_length=2000)]


class ShotRequest(Request):
    """What an operator sets of one shot; at most one of `tank_pressure_pa` (gauge) and
    `impact_velocity_m_s`.

    Without either a gun fires it with `TANK_PRESSURE_PA`; other benches need the velocity, before
    contact. The mass is the bench's where none is given. The bounds are orders of magnitude beyond
    any bench.
    """

    tank_pressure_pa: _Pressure | None = _quantity(
        None,
        "tank-pressure",
        "5bar",
        "Set the gauge pressure in the tank of the gun. [default: 5bar]",
    )
    impact_velocity_m_s: _Velocity | None = _quantity(
        None,
        "velocity",
        "20m/s",
        "Set the velocity of the bullet before contact, in place of the gun.",
    )
    bullet_mass_kg: _Mass | None = _quantity(
        None,
        "bullet-mass",
        "0.5kg",
        "Set the mass of the bullet. [default: 0.5kg, or the hammer of a hammer campaign]",
    )
    tip_material: Word = request_field(
        "steel",
        help="Name the material of the tip.",
        presentation=_option("tip", "MATERIAL", "material_names"),
    )
    tip_radius_m: _Radius = _quantity(
        0.045, "tip-radius", "45mm", "Set the radius of the ball of the tip. [default: 45mm]"
    )
    anvil_material: Word = request_field(
        NONE,
        help="Name the material of the anvil on the plate, or `none` if the bullet strikes the "
        "plate.",
        presentation=_option("anvil", "MATERIAL|none", "material_names"),
    )
    insulator: Literal["none", "polymeric"] = request_field(
        "none", help="Choose the insulator on the anvil. It needs an anvil."
    )
    impact_position: Word = request_field(
        "#1",
        help="Choose the point where the bullet strikes the plate.",
        presentation=Presentation(metavar="'#1'"),
    )
    boundary_conditions: Literal["free", "fixed"] | None = request_field(
        None, help="Say how the plate is held. [default: free]"
    )
    factor: pairs(_factor, Value) = request_field(  # type: ignore[valid-type]
        default_factory=dict,
        max_length=50,
        help="Set a factor that the model learned from, in SI: plate_mass_kg, or a factor of your "
        "own. The option can be repeated.",
        presentation=Presentation(metavar="NAME=VALUE", argument="factors"),
    )
    valve_profile: _ValveProfile | None = request_field(
        None,
        help="Set the position of the gun's valve over time, by points of seconds and "
        "position, where 0 is shut and 1 is open. [default: as the effects say]",
        presentation=Presentation(metavar="FILE.csv|'0:0 0.1:1'"),
    )

    @field_validator("impact_velocity_m_s")
    @classmethod
    def _replaces_the_gun(cls, velocity: float | None, info: ValidationInfo) -> float | None:
        if velocity is not None and info.data.get("tank_pressure_pa") is not None:
            raise ValueError("impact_velocity_m_s and tank_pressure_pa: expected one of them")
        return velocity

    @field_validator("insulator")
    @classmethod
    def _lies_on_an_anvil(cls, insulator: str, info: ValidationInfo) -> str:
        if insulator != NONE and str(info.data.get("anvil_material")).lower() == NONE:
            raise ValueError(
                f"insulator is {insulator!r} without an anvil; expected an anvil, on which it lies"
            )
        return insulator

    def check_gun(self, bench: Bench) -> None:
        """Raises `ValueError` for a bench without a gun where no velocity is given."""
        if not bench.has_gun and self.impact_velocity_m_s is None:
            raise ValueError(
                f"campaign {bench.campaign!r} is of kind {bench.kind!r} and has no gun: give the "
                "impact velocity, such as --velocity 1.5m/s"
            )

    def setting(self, built: BuiltTwin) -> Setting:
        """On the twin's plate. Raises `LookupError` for an unknown material, `ValueError` as
        `Setting`, for a bench without a gun where no velocity is given, and for a factor that no
        stage of the twin uses."""
        from ....dataset.sources import STATED_PLATE_MASS
        from ....signals.valve_profile import ValveProfile
        from .factors import check_used

        check_used(built, self.factor, self.boundary_conditions)
        self.check_gun(built.bench)
        fired = self.tank_pressure_pa is None and self.impact_velocity_m_s is None
        factors: dict[str, Any] = dict(self.factor)
        plate = {name: factors.pop(name) for name in (STATED_PLATE_MASS,) if name in factors}
        mass = self.bullet_mass_kg
        anvil, profile = self.anvil_material, self.valve_profile
        return built.setting(
            impactor_mass_kg=built.bench.impactor_mass_kg if mass is None else mass,
            tip=built.material(self.tip_material),
            tip_radius_m=self.tip_radius_m,
            tank_pressure_pa=TANK_PRESSURE_PA if fired else self.tank_pressure_pa,
            impact_velocity_m_s=self.impact_velocity_m_s,
            anvil=None if anvil.lower() == NONE else built.material(anvil),
            insulator=self.insulator,
            impact_position=self.impact_position,
            boundary_conditions=self.boundary_conditions or "free",
            factors=factors,
            valve_profile=None if profile is None else ValveProfile.parse(profile),
            **plate,
        )


class BandDraws(Request):
    """The random draws that bands are computed from."""

    draws: Annotated[int, Field(ge=0, le=100_000)] = request_field(
        DRAWS,
        help="Set the number of random draws that the bands are computed from; 0 gives the nominal "
        "shot alone.",
    )
    seed: Seed = request_field(0, help="Set the seed of the random draws.")

    @field_validator("draws")
    @classmethod
    def _is_soon_answered(cls, draws: int, info: ValidationInfo) -> int:
        if source_of(info) == "network" and draws > _MOST_NETWORK_DRAWS:
            most = f"{_MOST_NETWORK_DRAWS:,} over a network"
            raise ValueError(f"draws is {draws}; expected at most {most}")
        return draws


class DrawnShot(BandDraws, ShotRequest):
    """A shot of a twin that is there already."""


# --- the twin


def effects_of(effects: EffectsLike, name: str) -> tuple[Effect, ...]:
    """Effects as objects. Raises as `parse_effect`, and `ValueError` for a diagnosis that names no
    effect."""
    from ....twin.effects import Effect
    from ..diagnose.service import GapDiagnosis

    if isinstance(effects, GapDiagnosis):
        verdict = effects.verdict
        if not verdict.first.fitted:
            first, fits = " or ".join(verdict.first.effects), ", ".join(effects.fitted) or "nothing"
            raise ValueError(
                f"the likeliest cause in the diagnosis of {verdict.campaign} is {first}, which has "
                f"no effect to add; its attribute `fitted` has: {fits}"
            )
        return verdict.first.fitted
    listed = [effects] if isinstance(effects, str | Effect) else effects
    return tuple(
        parse_effect(effect, name) if isinstance(effect, str) else effect for effect in listed
    )


def parse_effect(text: str, name: str) -> Effect:
    """The effect with its parameters in SI.

    Raises `LookupError` for an effect that the catalogue does not have, and `ValueError` that says
    `name`, the argument or option, for a value that is no number.
    """
    from ....twin.effects import effect

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


def _effect_texts(value: Any, info: ValidationInfo) -> Any:
    """Effects as texts, which every door can give."""
    if not value:
        return ()
    given = value.splitlines() if isinstance(value, str) else value
    return tuple(map(_effect_text, effects_of(given, str(info.field_name))))


def _effect_text(effect: Effect) -> str:
    values = effect.as_json()
    identity = values.pop("id")
    parameters = ",".join(f"{name}={value!r}" for name, value in values.items())
    return f"{identity}:{parameters}" if parameters else str(identity)


def _frequencies(value: Any, info: ValidationInfo) -> Any:
    from ..impacts.spectra import checked_lines, parse_lines

    if value is None or value == "":
        return ""
    name = str(info.field_name)
    if isinstance(value, str):
        parse_lines(value, name)
        return value
    return ",".join(map(repr, checked_lines(value, name).tolist()))


class TwinOptions(TwinFields):
    """The twin that predicts: its bench and models, the effects that are added, and its spectra."""

    effects: Annotated[tuple[str, ...], BeforeValidator(_effect_texts)] = request_field(
        (),
        max_length=50,
        help="Add an effect to the nominal twin. The option can be repeated.",
        presentation=Presentation(
            metavar="ID[:NAME=VALUE,...]", option="effect", completion="effect_ids"
        ),
    )
    coupled: bool = request_field(
        False,
        help="Solve contact and plate together, which matters for thin plates and soft tips. The "
        "contact is prior or hertz.",
    )
    chain_height_m: _Height = _quantity(
        0.0,
        "chain-height",
        "112mm",
        "Say by how much the chain lifts the plate; a link is 56 mm. [default: 0 mm]",
    )
    frequencies: Annotated[str, BeforeValidator(_frequencies), Field(max_length=100_000)] = (
        request_field(
            "",
            help="Set the frequencies of the spectrum in Hz, as low:high:per_octave. [default: "
            "100:10000:6]",
            presentation=Presentation(metavar="LOW:HIGH:PER_OCTAVE"),
        )
    )

    @contextmanager
    def twin_request(self, **further: Any) -> Iterator[TwinRequest]:
        """The twin that is asked for, while its files can be read."""
        from ..impacts.spectra import parse_lines

        lines = parse_lines(self.frequencies, "frequencies").tolist() if self.frequencies else ()
        with super().twin_request(
            effects=effects_of(self.effects, "effects"),
            coupled=self.coupled,
            chain_height_m=self.chain_height_m,
            frequency_hz=tuple(lines),
            **further,
        ) as request:
            yield request


class PredictionRequest(TwinOptions, DrawnShot):
    """One shot, the twin that predicts it, and its bands."""


# --- many shots


def _content(path: Path) -> str:
    """Of a table of any encoding; a spreadsheet is read by its path."""
    return path.read_bytes().decode("utf-8-sig", "replace")


class _Table(Request):
    """Declared apart, so that it is known before the fields of one shot."""

    plan: Word | None = request_field(
        None,
        help="Predict every run of a plan in place of one shot.",
        presentation=Presentation(metavar="NAME", completion="plan_names"),
    )
    shots: text_file(50_000_000, _content) | None = request_field(  # type: ignore[valid-type]
        None,
        help="Predict every row of a table with the columns of runs.csv.",
        presentation=Presentation(metavar="FILE.csv"),
    )

    @field_validator("shots")
    @classmethod
    def _is_one_table(cls, shots: TextFile | None, info: ValidationInfo) -> TextFile | None:
        if shots is None:
            return None
        if info.data.get("plan") is not None:
            raise ValueError("--plan and --shots: expected one of them")
        if source_of(info) == "network" and len(shots.text) > _MOST_NETWORK_BYTES:
            raise ValueError(
                f"shots has {len(shots.text):,} characters; expected at most "
                f"{_MOST_NETWORK_BYTES:,} over a network"
            )
        return shots


class PredictionsRequest(PredictionRequest, _Table):
    """One shot, or the shots of a plan or of a table, and the twin that predicts them."""

    @field_validator(*ShotRequest.model_fields)
    @classmethod
    def _is_of_one_shot(cls, value: Any, info: ValidationInfo) -> Any:
        if info.data.get("plan") is not None or info.data.get("shots") is not None:
            raise ValueError(f"{info.field_name}: of one shot; with --plan or --shots leave it out")
        return value

    @field_validator("chain_height_m")
    @classmethod
    def _is_of_one_plate(cls, value: float, info: ValidationInfo) -> float:
        return float(cls._is_of_one_shot(value, info))

    @property
    def is_table(self) -> bool:
        """Whether many shots are asked for."""
        return self.plan is not None or self.shots is not None
