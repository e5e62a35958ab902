"""What effects, observables and stages are called in sentences, pictures and pages: the words of
the test bench."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from ....diagnosis.parameter_limits import exceeded_limit
from ....diagnosis.verdict import (
    NONE,
    UNKNOWN,
    Cause,
    Fitted,
    FrequencyBand,
    Shrinkage,
    TimeWindow,
    Unexplained,
    Verdict,
)
from ....twin.effects import catalogue
from ...common.number_format import format_interval, join_words, number, percent
from ...common.quantities import shown_unit

STAGE_NAMES = {"gun": "the gun", "contact": "the contact", "plate": "the plate"}

#: By the id of a shipped effect, as it stands in a sentence before "causes 61 % of it"; another
#: package's effect has a `subject` and a `check` of its own.
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
    "contact.effective_mass": "the mass of the impactor with "
    "everything that moves with it, on a balance",
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


#: An id of the catalogue in a text.
_EFFECT_ID = r"[a-z]+\.[a-z_]+"


def effect_subject(identity: str) -> str:
    """An effect as a sentence names it; the id itself for one that has no name, as of a package
    that is no longer installed."""
    kind = catalogue().get(identity)
    return EFFECT_SUBJECTS.get(identity) or (kind.subject if kind else "") or identity


def effect_check(identity: str) -> str:
    """What to measure on the bench for an effect; "" where nothing is known."""
    kind = catalogue().get(identity)
    return EFFECT_CHECKS.get(identity) or (kind.check if kind else "")


#: So many effects of a set are named in a sentence.
MOST_NAMES = 3
#: Headings of the two probabilities of a report: that an effect or one of a set acts, if the
#: catalogue has every cause; and that an entry of the causes is the whole answer, as experience on
#: virtual campaigns says.
ACTS, WHOLE_ANSWER = "probability that it acts", "probability of the whole answer"
#: Behind the names of effects of which at least one acts.
ALIKE = "which these runs cannot tell apart"


def set_name(effects: Sequence[str]) -> str:
    """A set of effects of which at least one acts, as every sentence, table and chart names it."""
    names = [effect_subject(identity) for identity in effects]
    if len(names) > MOST_NAMES:
        names = [*names[:MOST_NAMES], f"{len(names) - MOST_NAMES} more"]
    return names[0] if len(names) == 1 else f"{join_words(names, 'or')} ({ALIKE})"


def set_subject(name: str, last: str = "and") -> str:
    """An effect or a set of effects ("a+b") as a sentence names it."""
    return join_words([effect_subject(part) for part in name.split("+")], last)


def unexplained_interval(unexplained: Unexplained) -> tuple[float, float]:
    """The 90 % interval of what no effect explains, within what a part of the whole can be: at
    least nothing, and at most all of it where the share is no more."""
    low, high = unexplained.ci90
    share = unexplained.share
    return max(low, min(share, 0.0)), min(high, max(share, 1.0))


def stage_name(name: str) -> str:
    """A stage as a sentence names it."""
    return STAGE_NAMES.get(name, f"the stage {name}")


def single_effects(names: Iterable[str]) -> tuple[str, ...]:
    """The ids in names of effects and of sets of effects ("a+b"), each once."""
    return tuple(dict.fromkeys(identity for name in names for identity in name.split("+")))


@dataclass(frozen=True)
class ObservableLabel:
    """`text` names the observable. `relative`: its residual is a difference of natural logarithms,
    which is shown as per cent of the simulated value."""

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
    """The physical label of an observable by its name within its stage ("ln_width_tenth",
    "acceleration_1 delay").

    An observable that has none keeps its name, without underscores.
    """
    if name in _FEATURES:
        return ObservableLabel(_FEATURES[name], relative=name.startswith("ln_"))
    for pattern, text in _OF_PLATE:
        if match := re.fullmatch(pattern, name):
            words = {
                key: value.replace("_", " ") if key == "c" else value
                for key, value in match.groupdict().items()
            }
            return ObservableLabel(text.format(**words), relative="ln " in pattern)
    return ObservableLabel(name.replace("_", " "), relative=False)


def with_labels(sentence: str) -> str:
    """A sentence with the physical labels in the place of the names of observables."""
    names = "|".join(map(re.escape, _FEATURES))
    return re.sub(rf"\b({names})\b", lambda match: _FEATURES[match[1]], sentence)


def span_label(span: TimeWindow | FrequencyBand) -> str:
    """Where the gap of a channel stands out: `the force from 0.1 to 0.4 ms`, `the force from 800 to
    4000 Hz`."""
    if isinstance(span, TimeWindow):
        low, high, unit = 1e3 * span.from_s, 1e3 * span.to_s, "ms"
    else:
        low, high, unit = span.from_hz, span.to_hz, "Hz"
    return f"the {span.channel.replace('_', ' ')} from {number(low)} to {number(high)} {unit}"


def parameter_label(name: str, unit: str) -> str:
    """`gun.valve_flow.opening_time_s` -> `opening time`: without its effect and its unit."""
    own = name
    for identity in catalogue():
        own = own.removeprefix(f"{identity}.")
    word, bracket, group = own.partition(" (")
    endings = {"m/N": "_m_n", "s/m": "_s_m", "1/N": "_1_n", "1/s": "_1_s", "m3": "_m3"}
    ending = endings.get(unit, f"_{unit.lower()}")
    return f"{word.removesuffix(ending) if unit else word}{bracket}{group}".replace("_", " ")


def fitted_words(parameter: Fitted, effect: str = "") -> str:
    """`opening time = 255 ms (237 to 274 ms)`, in the units of the field; the brackets hold the 90
    % interval, and say where the value is none that the part of the `effect` can have."""
    unit, scale = shown_unit(parameter.unit)
    value, low, high = format_interval(
        *(scale * item for item in (parameter.value, *parameter.ci90))
    )
    label = parameter_label(parameter.name, parameter.unit)
    mark = _range_mark(effect, parameter)
    return f"{label} = {f'{value} {unit}'.rstrip()} ({low} to {f'{high} {unit}'.rstrip()}{mark})"


def _range_mark(effect: str, parameter: Fitted) -> str:
    """`; outside its range, which ends at 5`; "" for a value that the part can have."""
    exceeded = exceeded_limit(effect, parameter.parameter, parameter.value)
    if exceeded is None:
        return ""
    unit, scale = shown_unit(parameter.unit)
    limit = f"{number(scale * exceeded.limit)} {unit}".rstrip()
    where = "outside its range, which ends at" if exceeded.is_beyond else "at the end of its range,"
    return f"; {where} {limit}"


def owned_parameters(cause: Cause) -> list[tuple[str, Fitted]]:
    """Parameters of an entry with their effects: those that bear no effect's name are of the first
    one."""
    effects = single_effects(cause.effects)
    return [
        (next((name for name in effects if item.name.startswith(f"{name}.")), effects[0]), item)
        for item in cause.parameters
    ]


def spell_sets(text: str) -> str:
    """A text with `a, b and c` for effects that act together, which reports join to "a+b+c"."""
    return re.sub(
        rf"{_EFFECT_ID}(\s?\+\s?{_EFFECT_ID})+",
        lambda ids: join_words(re.split(r"\s?\+\s?", ids[0])),
        text,
    )


def cause_name(cause: Cause) -> str:
    """The ids of an entry; a group's with their shares."""
    if len(cause.effects) == 1:
        return spell_sets(cause.effects[0])
    has_sets = any("+" in name for name in cause.effects)
    return (", or " if has_sets else " or ").join(
        f"{spell_sets(name)}{share}" for name, share in _alternatives(cause)
    )


def _alternatives(cause: Cause) -> list[tuple[str, str]]:
    """Each answer of a group, with its share of the probability in brackets where it is known."""
    has_shares = len(cause.split) == len(cause.effects) > 1
    shares = (
        [f" ({percent(share)})" for share in cause.split]
        if has_shares
        else [""] * len(cause.effects)
    )
    return list(zip(cause.effects, shares, strict=True))


def cause_title(cause: Cause) -> str:
    """What an entry of the causes says, without its effects: they are listed below it."""
    if cause.effects[0] in (NONE, UNKNOWN):
        return {
            NONE: "Model and measurement agree",
            UNKNOWN: "A cause that is not in the catalogue",
        }[cause.effects[0]]
    if len(cause.effects) > 1:
        return f"One of {len(cause.effects)} answers, which these runs cannot tell apart"
    count = len(cause.effects[0].split("+"))
    return (
        f"{count} effects together"
        if count > 1
        else sentence_start(effect_subject(cause.effects[0]))
    )


def sentence_start(text: str) -> str:
    """A text as the beginning of a sentence."""
    return f"{text[:1].upper()}{text[1:]}"


def cause_lines(cause: Cause) -> list[str]:
    """A line for each effect: its id, what it is, and its parameters; of several answers each, with
    its share."""
    if cause.effects[0] in (NONE, UNKNOWN):
        return []
    if len(cause.effects) == 1:
        return [_effect_line(name, cause) for name in cause.effects[0].split("+")]
    shared = [
        name
        for name in single_effects(cause.effects)
        if all(name in a.split("+") for a in cause.effects)
    ]
    lines = [f"In every answer: {_effect_line(name, cause)}" for name in shared]
    for number_of_answer, (name, share) in enumerate(_alternatives(cause), 1):
        own = [part for part in name.split("+") if part not in shared]
        effects = "; ".join(_effect_line(part, cause) for part in own) or "no further effect"
        lines.append(f"Answer {number_of_answer}{share}: {effects}")
    return lines


def _effect_line(identity: str, cause: Cause) -> str:
    words = [
        fitted_words(item, owner) for owner, item in owned_parameters(cause) if owner == identity
    ]
    parameters = f": {', '.join(words)}" if words else ""
    subject = effect_subject(identity)
    return f"{identity}{f', {subject}' if subject != identity else ''}{parameters}"


def held_out_name(entry: Shrinkage, verdict: Verdict) -> str:
    """What takes the error away where it was not fitted, as the path names it; `effects` of the
    entry are what most folds chose, of several effects that cannot be told apart any."""
    if verdict.path:
        several = any(
            len(step.effects) > 1 for step in verdict.path
        )  # "a or b and c" can be read in two ways
        names = [step.added for step in verdict.path]
        return ", and ".join(names) if several else join_words(names)
    return join_words([spell_sets(name) for name in entry.effects]) or "no effect"
