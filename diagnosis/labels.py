"""What effects, observables and stages are called in sentences, pictures and pages: the words of the test bench."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

STAGE_NAMES = {"gun": "the gun", "contact": "the contact", "plate": "the plate"}


@dataclass(frozen=True)
class EffectName:
    """`subject` stands in a sentence before "causes 61 % of it". `check` completes "measure ...": what on the bench
    shows the effect by itself, without the model."""

    subject: str
    check: str


#: By the id of the catalogue.
EFFECT_NAMES: dict[str, EffectName] = {
    "gun.back_pressure": EffectName(
        "the atmosphere ahead of the projectile", "the absolute pressure in the tank and in the barrel before the shot"
    ),
    "gun.barrel_loss": EffectName(
        "the flow resistance of the barrel", "the velocity at two or more places along the barrel"
    ),
    "gun.blow_by": EffectName(
        "the leak past the projectile", "the clearance between projectile and barrel with a bore gauge"
    ),
    "gun.dead_volume": EffectName(
        "the dead volume between valve and projectile", "the volume between valve and projectile by filling it"
    ),
    "gun.heat_exchange": EffectName(
        "the heat that the gas takes from the walls", "the tank's pressure and temperature directly after the shot"
    ),
    "gun.sliding_friction": EffectName(
        "the friction of the projectile in the barrel", "the force that pushes the projectile slowly through the barrel"
    ),
    "gun.valve_flow": EffectName(
        "the flow resistance of the valve", "the pressure behind the projectile during the shot"
    ),
    "contact.effective_mass": EffectName(
        "the mass that strikes", "the mass of the impactor with everything that moves with it, on a balance"
    ),
    "contact.layer_compliance": EffectName(
        "the compliance of the insulating layer", "the layer's deflection under a known static load"
    ),
    "contact.plastic_yield": EffectName(
        "the plastic yield of tip or target", "the diameter of the permanent indentation after a hit"
    ),
    "contact.plate_compliance": EffectName(
        "the plate that gives way under the impact", "the velocity of the plate at the impact point during the contact"
    ),
    "contact.tip_geometry": EffectName("the shape of the tip", "the tip's profile with a radius gauge or a microscope"),
    "contact.viscous_loss": EffectName(
        "the damping of the contact", "the velocity of the rebound (coefficient of restitution)"
    ),
    "plate.boundary": EffectName(
        "the stiffness of the plate's supports", "the rigid-body frequency of the plate on its supports"
    ),
    "plate.damping": EffectName("the damping of the plate", "the decay of single modes after a light tap"),
    "plate.sensor_mass": EffectName(
        "the mass of the accelerometers on the plate", "the plate's frequencies with one accelerometer removed"
    ),
    "plate.stiffness": EffectName(
        "the stiffness of the plate", "the plate's thickness, and its frequencies after a light tap"
    ),
    "sensor.acceleration_gain": EffectName(
        "the sensitivity of an accelerometer", "the accelerometer against a calibrator or a second accelerometer"
    ),
    "sensor.force_bandwidth": EffectName(
        "the limited bandwidth of the force channel", "the force channel's step response, or the settings of its filter"
    ),
    "sensor.force_gain": EffectName(
        "the sensitivity of the force channel", "the force channel against a known mass (ISO 7626-5)"
    ),
    "sensor.mount_resonance": EffectName(
        "the resonance of an accelerometer's mounting", "the accelerometer's mounted resonance after mounting it anew"
    ),
    "sensor.pressure_gain": EffectName(
        "the sensitivity of the pressure transducer", "the tank pressure with a second gauge at two pressures"
    ),
    "sensor.pressure_offset": EffectName(
        "the zero offset of the pressure transducer", "the transducer's reading with an open tank"
    ),
    "sensor.velocity_gain": EffectName(
        "the sensitivity of the velocity measurement", "the projectile's length and the distance of the light barriers"
    ),
    "sensor.zero_shift": EffectName(
        "the zero shift of an accelerometer", "the accelerometer's level at rest after the shock"
    ),
}


def effect_subject(identity: str) -> str:
    """An effect as a sentence names it; the id itself for one that has no name."""
    name = EFFECT_NAMES.get(identity)
    return identity if name is None else name.subject


def effect_check(identity: str) -> str:
    """What to measure on the bench for an effect; "" where nothing is known."""
    name = EFFECT_NAMES.get(identity)
    return "" if name is None else name.check


@dataclass(frozen=True)
class ObservableLabel:
    """`text` names the observable. `relative`: its residual is a difference of natural logarithms, which is shown as
    per cent of the simulated value."""

    text: str
    relative: bool


_FEATURES = {
    "ln_velocity": ObservableLabel("muzzle velocity", relative=True),
    "ln_peak": ObservableLabel("peak force", relative=True),
    "ln_impulse": ObservableLabel("impulse", relative=True),
    "ln_width_half": ObservableLabel("pulse width at 50 % of the peak", relative=True),
    "ln_width_tenth": ObservableLabel("pulse width at 10 % of the peak", relative=True),
    "rise_share": ObservableLabel("rise time over pulse width", relative=False),
    "skew": ObservableLabel("pulse shape: skewness", relative=False),
    "fatness": ObservableLabel("pulse shape: fullness", relative=False),
    "shape_3": ObservableLabel("pulse shape: third Legendre coefficient", relative=False),
    "shape_4": ObservableLabel("pulse shape: fourth Legendre coefficient", relative=False),
    "after_share": ObservableLabel("impulse after the contact over the whole impulse", relative=False),
}
_FeatureOf = Callable[[re.Match[str]], ObservableLabel]
#: Observables of the plate carry channel, frequency and time in their names.
_OF_PLATE: tuple[tuple[str, _FeatureOf], ...] = (
    (r"ln frequency of the mode at (?P<f>.+)", lambda m: ObservableLabel(f"frequency of the mode at {m['f']}", True)),
    (r"ln damping of the mode at (?P<f>.+)", lambda m: ObservableLabel(f"damping of the mode at {m['f']}", True)),
    (
        r"(?P<c>.+) spectrum at (?P<f>.+)",
        lambda m: ObservableLabel(f"shock response spectrum at {m['f']}, {_channel(m['c'])}", False),
    ),
    (
        r"(?P<c>.+) ln amplitude of the mode at (?P<f>.+)",
        lambda m: ObservableLabel(f"amplitude of the mode at {m['f']}, {_channel(m['c'])}", True),
    ),
    (
        r"(?P<c>.+) rest from (?P<t>.+ ms)",
        lambda m: ObservableLabel(f"level at rest from {m['t']} over the peak, {_channel(m['c'])}", False),
    ),
    (r"(?P<c>.+) delay", lambda m: ObservableLabel(f"delay over the contact time, {_channel(m['c'])}", False)),
)


def observable_label(name: str) -> ObservableLabel:
    """The physical label of an observable by its name within its stage ("ln_width_tenth", "acceleration_1 delay").

    An observable that has none keeps its name, without underscores.
    """
    if name in _FEATURES:
        return _FEATURES[name]
    for pattern, label in _OF_PLATE:
        if match := re.fullmatch(pattern, name):
            return label(match)
    return ObservableLabel(name.replace("_", " "), relative=False)


def with_labels(sentence: str) -> str:
    """A sentence with the physical labels in the place of the names of observables."""
    names = "|".join(map(re.escape, _FEATURES))
    return re.sub(rf"\b({names})\b", lambda match: _FEATURES[match[1]].text, sentence)


def _channel(name: str) -> str:
    """ "acceleration_1" as "acceleration 1"."""
    return name.replace("_", " ")
