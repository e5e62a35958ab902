"""What effects, observables and stages are called in sentences, pictures and pages: the words of the test bench."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from ...diagnosis.verdict import CORRECTED, NONE, UNKNOWN, Cause, Fitted, FrequencyBand, Shrinkage, TimeWindow, Where
from ...twin.effects import catalogue
from ..common.number_format import number, number_beside, percent, percent_with_range

STAGE_NAMES = {"gun": "the gun", "contact": "the contact", "plate": "the plate"}

#: By the id of the catalogue: an effect as it stands in a sentence before "causes 61 % of it".
EFFECT_SUBJECTS = {
    "gun.back_pressure": "the atmosphere ahead of the projectile",
    "gun.barrel_loss": "the flow resistance of the barrel",
    "gun.blow_by": "the leak past the projectile",
    "gun.dead_volume": "the dead volume between valve and projectile",
    "gun.heat_exchange": "the heat that the gas takes from the walls",
    "gun.sliding_friction": "the friction of the projectile in the barrel",
    "gun.valve_flow": "the flow resistance of the valve",
    "contact.effective_mass": "the mass that strikes",
    "contact.layer_compliance": "the compliance of the insulating layer",
    "contact.plastic_yield": "the plastic yield of tip or target",
    "contact.plate_compliance": "the plate that gives way under the impact",
    "contact.tip_geometry": "the shape of the tip",
    "contact.viscous_loss": "the damping of the contact",
    "plate.boundary": "the stiffness of the plate's supports",
    "plate.damping": "the damping of the plate",
    "plate.sensor_mass": "the mass of the accelerometers on the plate",
    "plate.stiffness": "the stiffness of the plate",
    "sensor.acceleration_gain": "the sensitivity of an accelerometer",
    "sensor.force_bandwidth": "the limited bandwidth of the force channel",
    "sensor.force_gain": "the sensitivity of the force channel",
    "sensor.mount_resonance": "the resonance of an accelerometer's mounting",
    "sensor.pressure_gain": "the sensitivity of the pressure transducer",
    "sensor.pressure_offset": "the zero offset of the pressure transducer",
    "sensor.velocity_gain": "the sensitivity of the velocity measurement",
    "sensor.zero_shift": "the zero shift of an accelerometer",
}
#: What completes "measure ...": what on the bench shows the effect by itself, without the model.
EFFECT_CHECKS = {
    "gun.back_pressure": "the absolute pressure in the tank and in the barrel before the shot",
    "gun.barrel_loss": "the velocity at two or more places along the barrel",
    "gun.blow_by": "the clearance between projectile and barrel with a bore gauge",
    "gun.dead_volume": "the volume between valve and projectile by filling it",
    "gun.heat_exchange": "the tank's pressure and temperature directly after the shot",
    "gun.sliding_friction": "the force that pushes the projectile slowly through the barrel",
    "gun.valve_flow": "the pressure behind the projectile during the shot",
    "contact.effective_mass": "the mass of the impactor with everything that moves with it, on a balance",
    "contact.layer_compliance": "the layer's deflection under a known static load",
    "contact.plastic_yield": "the diameter of the permanent indentation after a hit",
    "contact.plate_compliance": "the velocity of the plate at the impact point during the contact",
    "contact.tip_geometry": "the tip's profile with a radius gauge or a microscope",
    "contact.viscous_loss": "the velocity of the rebound (coefficient of restitution)",
    "plate.boundary": "the rigid-body frequency of the plate on its supports",
    "plate.damping": "the decay of single modes after a light tap",
    "plate.sensor_mass": "the plate's frequencies with one accelerometer removed",
    "plate.stiffness": "the plate's thickness, and its frequencies after a light tap",
    "sensor.acceleration_gain": "the accelerometer against a calibrator or a second accelerometer",
    "sensor.force_bandwidth": "the force channel's step response, or the settings of its filter",
    "sensor.force_gain": "the force channel against a known mass (ISO 7626-5)",
    "sensor.mount_resonance": "the accelerometer's mounted resonance after mounting it anew",
    "sensor.pressure_gain": "the tank pressure with a second gauge at two pressures",
    "sensor.pressure_offset": "the transducer's reading with an open tank",
    "sensor.velocity_gain": "the projectile's length and the distance of the light barriers",
    "sensor.zero_shift": "the accelerometer's level at rest after the shock",
}


def effect_subject(identity: str) -> str:
    """An effect as a sentence names it; the id itself for one that has no name."""
    return EFFECT_SUBJECTS.get(identity, identity)


def effect_check(identity: str) -> str:
    """What to measure on the bench for an effect; "" where nothing is known."""
    return EFFECT_CHECKS.get(identity, "")


def single_effects(names: Iterable[str]) -> tuple[str, ...]:
    """The ids in names of effects and of sets of effects ("a+b"), each once."""
    return tuple(dict.fromkeys(identity for name in names for identity in name.split("+")))


@dataclass(frozen=True)
class ObservableLabel:
    """`text` names the observable. `relative`: its residual is a difference of natural logarithms, which is shown as
    per cent of the simulated value."""

    text: str
    relative: bool


_FEATURES = {
    "ln_velocity": "muzzle velocity",
    "ln_peak": "peak force",
    "ln_impulse": "impulse",
    "ln_width_half": "pulse width at 50 % of the peak",
    "ln_width_tenth": "pulse width at 10 % of the peak",
    "rise_share": "rise time over pulse width",
    "skew": "pulse shape: skewness",
    "fatness": "pulse shape: fullness",
    "shape_3": "pulse shape: third Legendre coefficient",
    "shape_4": "pulse shape: fourth Legendre coefficient",
    "after_share": "impulse after the contact over the whole impulse",
}
#: Observables of the plate carry channel, frequency and time in their names.
_OF_PLATE = (
    (r"ln frequency of the mode at (?P<f>.+)", "frequency of the mode at {f}"),
    (r"ln damping of the mode at (?P<f>.+)", "damping of the mode at {f}"),
    (r"(?P<c>.+) spectrum at (?P<f>.+)", "shock response spectrum at {f}, {c}"),
    (r"(?P<c>.+) ln amplitude of the mode at (?P<f>.+)", "amplitude of the mode at {f}, {c}"),
    (r"(?P<c>.+) rest from (?P<t>.+ ms)", "level at rest from {t} over the peak, {c}"),
    (r"(?P<c>.+) delay", "delay over the contact time, {c}"),
)


def observable_label(name: str) -> ObservableLabel:
    """The physical label of an observable by its name within its stage ("ln_width_tenth", "acceleration_1 delay").

    An observable that has none keeps its name, without underscores.
    """
    if name in _FEATURES:
        return ObservableLabel(_FEATURES[name], relative=name.startswith("ln_"))
    for pattern, text in _OF_PLATE:
        if match := re.fullmatch(pattern, name):
            words = {key: value.replace("_", " ") if key == "c" else value for key, value in match.groupdict().items()}
            return ObservableLabel(text.format(**words), relative="ln " in pattern)
    return ObservableLabel(name.replace("_", " "), relative=False)


def with_labels(sentence: str) -> str:
    """A sentence with the physical labels in the place of the names of observables."""
    names = "|".join(map(re.escape, _FEATURES))
    return re.sub(rf"\b({names})\b", lambda match: _FEATURES[match[1]], sentence)


def span_label(span: TimeWindow | FrequencyBand) -> str:
    """Where the gap of a channel stands out: `the force from 0.1 to 0.4 ms`, `the force from 800 to 4000 Hz`."""
    if isinstance(span, TimeWindow):
        low, high, unit = 1e3 * span.from_s, 1e3 * span.to_s, "ms"
    else:
        low, high, unit = span.from_hz, span.to_hz, "Hz"
    return f"the {span.channel.replace('_', ' ')} from {number(low)} to {number(high)} {unit}"


def fitted_words(parameter: Fitted) -> str:
    """`compliance_m_n = 3.4e-08 m/N (2.6e-08 to 4.1e-08)`."""
    low, high = parameter.ci90
    value, low_text, high_text = (number_beside(item, high - low) for item in (parameter.value, low, high))
    return f"{parameter.name} = {f'{value} {parameter.unit}'.rstrip()} ({low_text} to {high_text})"


def cause_name(cause: Cause) -> str:
    """The ids of an entry; a group's with their shares."""
    if len(cause.effects) == 1:
        return cause.effects[0]
    if len(cause.split) != len(cause.effects):
        return " or ".join(cause.effects)
    return " or ".join(f"{name} ({percent(share)})" for name, share in zip(cause.effects, cause.split, strict=True))


def effect_title(identity: str) -> str:
    """The equation of an effect; what "none" and "unknown" mean."""
    words: Mapping[str, str] = {NONE: "agreement within tolerance", UNKNOWN: "nothing in the catalogue"}
    if identity in words:
        return words[identity]
    return f"{identity}: {catalogue()[identity].law}" if identity in catalogue() else ""


def where_lines(where: Where) -> Iterator[str]:
    """A sentence for each finding about where the error lies."""
    for stage in where.stage:
        share = percent_with_range(stage.share, stage.ci90)
        yield (
            f"The {stage.name} makes {share} of the error at the end of the chain; its own error is "
            f"{number(stage.own)} tolerances."
        )
    for region in where.factors:
        yield (
            f"Where {region.rule}, the error exceeds that of the other settings by {number(region.excess)} times the "
            f"measurement noise (p = {number(region.p_value)})."
        )
    for window in where.time:
        yield f"In time the error stands out in {span_label(window)}."
    for band in where.frequency:
        yield f"In frequency the error stands out in {span_label(band)}."
    yield from map(with_labels, where.drift)


def shrinkage_line(entry: Shrinkage) -> str:
    """One sentence on configurations that the fit has not seen."""
    what = " + ".join(entry.effects) or "No effect"
    sizes = f"{number(entry.before)} before, {number(entry.after)} after, held out by {entry.held_out_by}"
    if entry.fraction is None:
        return f"{what}: {sizes}; there was no error to reduce."
    share = percent(entry.fraction) if entry.ci90 is None else percent_with_range(entry.fraction, entry.ci90)
    sentence = f"{what}: {sizes}; {share} of the error above the noise disappears"
    if CORRECTED not in entry.more:
        return f"{sentence}."
    after = number(entry.more[CORRECTED][1])
    return f"{sentence}. With a learned correction of the rest {after} would be left; a correction is not a cause."
