"""Draws what a withheld campaign hides: design, cause, strength, background, noise.

Draws benches on which many effects act at once, and benches whose effects obey second laws: the
tiers `realistic` and `foreign` of the blind check, and those that score what a reader acts on.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from .case import GUN_AND_CONTACT, GUN_KINDS, KINDS, STAGES, TIERS, Case
from .designs import DESIGNS, design
from .effect_size import changes, gaps
from .run_scatter import draw_background
from .scale_cause import (
    FLOORS,
    RANGES,
    inside,
    largest,
    ratio_of,
    shown_by,
    signs,
    sized,
    strength_for,
    whole_cause,
    with_cause,
)
from .unknowns import FAMILIES, families

#: Share of cases with a nominal figure that is a little off, and by how much at most.
_DECOYS = 0.33
_DECOY_SPREAD = {"gun": 0.006, "contact": 0.01, "plate": 0.03}
_DRAW_TRIES = 60
#: Two effects: each of them alone, and both together, in floors.
_EACH, _BOTH = 1.5, (3.0, 20.0)


def draw_case(
    kind: str,
    tier: str,
    rng: np.random.Generator,
    *,
    cause: str = "catalogue",
    split: str = "sealed",
    rough: bool = False,
    decoy: bool | None = None,
    number: int | None = None,
) -> Case:
    """A case whose gap over floor lies in a tier.

    With a named cause whose physical range does not reach the tier the case has what is nearest:
    `Label.tier` says where it is.

    Parameters:
        kind: The kind of campaign: "gun", "hammer", "plate" or "chain".
        tier: The range of the gap over floor, by its name in `TIERS`. The causes "none" and "two"
            take no notice of it.
        rng: Random numbers from which the case is drawn.
        cause: "catalogue" (one effect, drawn), which is the default, "none", "unknown" (a family of
            `split`), "two" effects, or the name of an effect or family.
        split: The split whose families outside of the catalogue may be drawn; by default "sealed".
        rough: Whether the background is rougher than the diagnosis assumes; by default it is not.
        decoy: Whether a nominal figure is mis-stated within tolerance; by default in a third of the
            cases.
        number: The number of the design; by default it is drawn.

    Raises:
        ValueError: For unknown words, for a cause that the kind cannot show, and where no such case
            is drawn.
    """
    _check(kind, tier, cause)
    for _ in range(_DRAW_TRIES):
        case = base_case(kind, tier, rng, rough=rough, number=number)
        case = replace(case, decoys=_decoys(kind, rng, decoy))
        drawn_case = (
            _CAUSES[cause](case, rng, split) if cause in _CAUSES else with_cause(case, cause, rng)
        )
        if drawn_case:
            return drawn_case
    raise ValueError(f"no {kind} case found in {_DRAW_TRIES} draws: cause {cause!r}, tier {tier!r}")


def _check(kind: str, tier: str, cause: str) -> None:
    if kind not in KINDS:
        raise ValueError(f"kind {kind!r}: expected one of {', '.join(KINDS)}")
    if tier not in TIERS:
        raise ValueError(f"tier {tier!r}: expected one of {', '.join(TIERS)}")
    cause_names = [*_CAUSES, *RANGES, *FAMILIES]
    if cause not in cause_names:
        raise ValueError(f"cause {cause!r}: expected one of {', '.join(cause_names)}")
    shown = {name for number in range(DESIGNS) for name in shown_by(kind, number)}
    shown |= {name for name, family in FAMILIES.items() if family.stage in STAGES[kind]}
    if cause not in _CAUSES and cause not in shown:
        raise ValueError(f"cause {cause!r}: a {kind} campaign cannot show it")


def base_case(
    kind: str,
    tier: str,
    rng: np.random.Generator,
    *,
    rough: bool = False,
    number: int | None = None,
) -> Case:
    """A case without a cause: its plan, background, noise and the order of its runs.

    Parameters:
        kind: The kind of campaign, one of `ALL_KINDS`.
        tier: The range of the gap over floor, by its name in `TIERS`; the case only keeps this
            name.
        rng: Random numbers from which the case is drawn.
        rough: Whether the background is rougher than the diagnosis assumes; by default it is not.
        number: The number of the design; by default it is drawn.
    """
    return Case(
        kind=kind,
        tier=tier,
        design=int(rng.integers(DESIGNS)) if number is None else number,
        repetitions=int(rng.integers(3, 5)),
        floor=float(rng.uniform(*FLOORS)),
        background=draw_background(rng, rough=rough),
        blocked=bool(rng.random() < 0.5),
        sampling_rate_hz=float(rng.choice([51_200.0, 102_400.0]))
        if kind == "hammer"
        else 102_400.0,
    )


def _decoys(kind: str, rng: np.random.Generator, wanted: bool | None) -> dict[str, float]:
    drawn, stage = bool(rng.random() < _DECOYS), str(rng.choice(STAGES[kind]))
    name = {
        "gun": str(rng.choice(["tank_volume_m3", "travel_m"])),
        "contact": "mass_kg",
        "plate": "damping_ratio",
    }
    factor = 1 + float(rng.uniform(-1, 1)) * _DECOY_SPREAD[stage]
    if kind == "chain" and stage == "contact":
        return {}  # a shot's mass stands in its row
    return {name[stage]: factor} if (drawn if wanted is None else wanted) else {}


Draw = Callable[[Case, np.random.Generator, str], Case | None]


def _unknown(case: Case, rng: np.random.Generator, split: str) -> Case | None:
    name = str(rng.choice(families(case.kind, split)))
    setting = FAMILIES[name].varies
    if (
        setting
        and len(
            {getattr(configuration, setting) for configuration in design(case.kind, case.design)}
        )
        < 2
    ):
        return None
    return _fitting(case, name, rng)


def _fitting(case: Case, name: str, rng: np.random.Generator) -> Case | None:
    """None where the cause does not reach the tier."""
    fitting_case = with_cause(case, name, rng)
    return (
        fitting_case
        if fitting_case is not None and inside(fitting_case, TIERS[case.tier])
        else None
    )


# One signature for all.
def _two(case: Case, rng: np.random.Generator, split: str) -> Case | None:  # noqa: ARG001
    names = rng.choice(shown_by(case.kind, case.design), 2, replace=False).tolist()
    strengths: dict[str, float] = {}
    for name in names:
        ratio = math.exp(rng.uniform(math.log(1.7), math.log(12.0)))
        single_case = sized(case, name, int(rng.choice(signs(name))), ratio, rng)
        if ratio_of(replace(single_case, floor=case.floor)) < _EACH:
            return None
        strengths |= single_case.strengths
    both = replace(case, strengths=strengths)
    return both if inside(both, _BOTH) else None


_CAUSES: dict[str, Draw] = {
    "catalogue": lambda case, rng, _: _fitting(
        case, str(rng.choice(shown_by(case.kind, case.design))), rng
    ),
    "none": lambda case, _rng, _split: case,
    "unknown": _unknown,
    "two": _two,
}

#: Strength 1 of the virtual bench in the unit of `RANGES`, for the effects whose unit is another
#: one. Sensors: what their data sheets allow (`campaigns.gun`, `campaigns.hammer`);
#: velocity: 1 mm of 85 mm; boundary: the plate of 9.3 kg on the ropes of `resonant_plate`, 8 kN/m.
BENCH_DEFAULT: Mapping[str, float] = {
    "plate.sensor_mass": 0.027,
    "plate.boundary": 4.7,
    "sensor.pressure_offset": 0.005,
    "sensor.pressure_gain": 0.005,
    "sensor.velocity_gain": 0.012,
    "sensor.force_gain": 0.01,
    "sensor.acceleration_gain": 0.01,
    "sensor.zero_shift": 0.001,
}
#: Strengths are drawn between these, evenly in their logarithm, in units of the bench's default.
WEAKEST, STRONGEST = 0.3, 3.0
#: How often an effect does not act.
OFF = 0.3
#: Every bench stands in an atmosphere.
ALWAYS = "gun.back_pressure"
#: Gap over all observables, in tolerances. A realistic bench has one beyond tolerance; otherwise
#: nothing is to explain.
USUAL_GAP = (1.5, 90.0)
#: At full scale; spectra of a plate have a wide tolerance, so that a large error is fewer of them.
FULL_SCALE: Mapping[str, tuple[float, float]] = {
    kind: (4.0 if kind == "plate" else 10.0, 60.0) for kind in (*KINDS, GUN_AND_CONTACT)
}
#: Gap in tolerances that each of many effects makes alone: at full scale, and where all of them are
#: small together.
ALONE_GAPS: Mapping[bool, tuple[float, float]] = {True: (1.0, 25.0), False: (0.7, 4.0)}
#: Gap in tolerances of a cause outside of the catalogue; of five effects that are small together.
OUTSIDE_GAP, SMALL_GAP = (2.0, 10.0), (2.0, 5.0)
#: Gap over floor of one effect, and of each of two, by second laws; and of all of them.
FOREIGN_RATIOS: Mapping[int, tuple[float, float]] = {1: (1.5, 6.0), 2: (1.7, 12.0)}
FOREIGN_GAPS: Mapping[int, tuple[float, float]] = {1: (1.5, 6.3), 2: (3.0, 20.0)}
_TRIES = 300
_STEP = 1.3


def draw_realistic(kind: str, rng: np.random.Generator, *, full_scale: bool = False) -> Case:
    """A case with every effect of its kind at a strength of 0.3 to 3 times the bench's default,
    each off with probability 0.3, errors that go either way with a random sign, in an atmosphere of
    0.9 to 1.04 standard ones.

    Parameters:
        kind: The kind of campaign, one of `ALL_KINDS`.
        rng: Random numbers from which the case is drawn.
        full_scale: Whether the gap is 10 to 60 tolerances (a plate's 4 to 60): where it is less,
            all effects but those of the sensors grow together within their physical ranges. By
            default the gap is 1.5 to 90 tolerances.

    Raises:
        ValueError: Where no such case is drawn.
    """
    limits = FULL_SCALE[kind] if full_scale else USUAL_GAP
    for _ in range(_TRIES):
        case = base_case(kind, "any", rng)
        case = replace(case, strengths=_strengths(kind, case.design, rng))
        if full_scale:
            case = _enlarged(case, limits[0])
        if limits[0] <= total_gap(case) <= limits[1]:
            return case
    raise ValueError(
        f"no realistic {kind} case found in {_TRIES} draws, full_scale = {full_scale!r}"
    )


def draw_foreign(kind: str, rng: np.random.Generator, split: str, *, effects: int) -> Case:
    """A case of one or two effects that act by second laws, with a gap of 1.5 to 6.3 floors (two: 3
    to 20, each 1.7 or more alone).

    Parameters:
        kind: The kind of campaign, one of `ALL_KINDS`.
        rng: Random numbers from which the case is drawn.
        split: The split whose second laws the effects obey.
        effects: How many effects act, 1 or 2.

    Raises:
        ValueError: Where no such case is drawn.
    """
    for _ in range(_TRIES):
        case = replace(base_case(kind, "any", rng), laws=split)
        names = rng.choice(shown_by(kind, case.design), effects, replace=False).tolist()
        low, high = FOREIGN_RATIOS[effects]
        strengths: dict[str, float] = {}
        for name in names:
            ratio = math.exp(rng.uniform(math.log(low), math.log(high)))
            single = sized(case, name, int(rng.choice(signs(name, split))), ratio, rng)
            strengths |= single.strengths
            # a weak effect is met with less noise, which all of the case then has
            case = replace(case, floor=min(case.floor, single.floor))
        if all(ratio_of(replace(case, strengths={n: v})) >= low for n, v in strengths.items()):
            foreign_case = replace(case, strengths=strengths)
            if inside(foreign_case, FOREIGN_GAPS[effects]):
                return foreign_case
    raise ValueError(f"no {kind} case of {effects} effects by second laws found in {_TRIES} draws")


def draw_foreign_bench(kind: str, rng: np.random.Generator, split: str) -> Case:
    """A case of five to seven effects that act by second laws, at full scale, in an atmosphere;
    sensors stay within their data sheets.

    Parameters:
        kind: The kind of campaign, one of `ALL_KINDS`.
        rng: Random numbers from which the case is drawn.
        split: The split whose second laws the effects obey.

    Raises:
        ValueError: Where no such case is drawn.
    """
    limits = FULL_SCALE[kind]
    for _ in range(_TRIES):
        case = replace(base_case(kind, "any", rng), laws=split)
        shown = [name for name in shown_by(kind, case.design) if name != ALWAYS]
        count = min(int(rng.integers(5, 8)), len(shown)) - (kind in ("gun", "chain"))
        names = rng.choice(shown, count, replace=False).tolist()
        strengths = {name: _strength(name, rng, split) for name in names}
        if kind in ("gun", "chain"):
            strengths[ALWAYS] = float(rng.uniform(RANGES[ALWAYS].low, RANGES[ALWAYS].high))
        case = _enlarged(replace(case, strengths=strengths), limits[0])
        if limits[0] <= total_gap(case) <= limits[1]:
            return case
    raise ValueError(f"no {kind} case at full scale by second laws found in {_TRIES} draws")


def draw_visible_bench(
    kind: str,
    rng: np.random.Generator,
    split: str,
    *,
    effects: tuple[int, int],
    limits: tuple[float, float],
) -> Case:
    """A case of several effects that act by second laws. What each effect makes alone is drawn
    evenly in its logarithm: a weak law is as strong as it has to be to be seen.

    A gun at full scale stands in an atmosphere, which counts as an effect; sensors stay within
    their data sheets.

    Parameters:
        kind: The kind of campaign, one of `ALL_KINDS`.
        rng: Random numbers from which the case is drawn.
        split: The split whose second laws the effects obey.
        effects: The least and the largest number of effects that act.
        limits: The least and the largest gap over all observables, in tolerances.

    Raises:
        ValueError: Where no such case is drawn.
    """
    full_scale = limits[1] > SMALL_GAP[1]
    atmosphere = full_scale and kind in GUN_KINDS
    for _ in range(_TRIES):
        case = replace(base_case(kind, "any", rng), laws=split)
        shown = [name for name in shown_by(kind, case.design) if name != ALWAYS]
        count = min(int(rng.integers(effects[0], effects[1] + 1)) - atmosphere, len(shown))
        names = rng.choice(shown, count, replace=False).tolist()
        strengths = {
            name: _visible_strength(case, name, ALONE_GAPS[full_scale], rng) for name in names
        }
        if atmosphere:
            strengths[ALWAYS] = float(rng.uniform(RANGES[ALWAYS].low, RANGES[ALWAYS].high))
        case = replace(case, strengths=strengths)
        if limits[0] <= total_gap(case) <= limits[1]:
            return case
    raise ValueError(f"no {kind} case of {effects} visible effects found in {_TRIES} draws")


def draw_outside(kind: str, rng: np.random.Generator, split: str) -> Case:
    """A case whose cause is a family outside of the catalogue, with a gap of 2 to 10 tolerances.

    Parameters:
        kind: The kind of campaign, one of `ALL_KINDS`.
        rng: Random numbers from which the case is drawn.
        split: The split whose families may be drawn.

    Raises:
        ValueError: Where no such case is drawn.
    """
    for _ in range(_TRIES):
        case = base_case(kind, "any", rng)
        name = str(rng.choice(families(kind, split)))
        setting = FAMILIES[name].varies
        if (
            setting
            and len(
                {getattr(configuration, setting) for configuration in design(kind, case.design)}
            )
            < 2
        ):
            continue
        wanted = math.exp(
            rng.uniform(math.log(OUTSIDE_GAP[0] * 1.05), math.log(OUTSIDE_GAP[1] * 0.95))
        )
        case = sized(case, name, 1, wanted / case.floor, rng)
        if OUTSIDE_GAP[0] <= ratio_of(case) * case.floor <= OUTSIDE_GAP[1]:
            return case
    raise ValueError(f"no {kind} case of a cause outside of the catalogue found in {_TRIES} draws")


def total_gap(case: Case) -> float:
    """Root mean square over all configurations and observables of all stages, in tolerances;
    infinite where a shot does not leave the barrel, and where the bench gives up on it.

    Parameters:
        case: The case, with its cause.
    """
    try:
        moved = changes(case.kind, case.design, whole_cause(case))
    except (
        RuntimeError
    ):  # too stiff for the integrator of the second laws: such a bench is drawn again
        return math.inf
    widths = {stage: rows.shape[1] for stage, rows in moved.items()}
    sizes = gaps(moved)
    if not np.isfinite(sum(sizes.values())):
        return math.inf
    return math.sqrt(
        sum(widths[s] * sizes[s] ** 2 for s in STAGES[case.kind]) / sum(widths.values())
    )


def _strengths(kind: str, number: int, rng: np.random.Generator) -> dict[str, float]:
    drawn: dict[str, float] = {}
    for name in shown_by(kind, number):
        if name == ALWAYS:
            drawn[name] = float(rng.uniform(RANGES[name].low, RANGES[name].high))
            continue
        strength = _strength(name, rng)
        if rng.random() >= OFF:
            drawn[name] = strength
    return drawn


def _strength(name: str, rng: np.random.Generator, laws: str = "") -> float:
    """0.3 to 3 times the bench's default, with a random sign where the effect has one."""
    size = math.exp(rng.uniform(math.log(WEAKEST), math.log(STRONGEST))) * BENCH_DEFAULT.get(
        name, 1.0
    )
    return int(rng.choice(signs(name, laws))) * size


def _visible_strength(
    case: Case, name: str, gaps: tuple[float, float], rng: np.random.Generator
) -> float:
    """At which an effect alone has a drawn gap (tolerances), or the largest that there is."""
    sign, wanted = (
        int(rng.choice(signs(name, case.laws))),
        math.exp(rng.uniform(math.log(gaps[0]), math.log(gaps[1]))),
    )
    strength = strength_for(case.kind, case.design, name, sign, wanted, laws=case.laws)
    strength = largest(name, sign, case.laws) if strength is None else strength
    most = STRONGEST * BENCH_DEFAULT.get(name, 1.0) if name.startswith("sensor.") else math.inf
    return sign * min(abs(strength), most)


def _enlarged(case: Case, least: float) -> Case:
    """With effects so much stronger, in steps, that the gap is at least so many tolerances, or all
    at their ends."""
    while total_gap(case) < least:
        larger = {name: _grown(name, value, case.laws) for name, value in case.strengths.items()}
        if larger == case.strengths:
            break
        case = replace(case, strengths=larger)
    return case


def _grown(name: str, value: float, laws: str) -> float:
    if name == ALWAYS or name.startswith("sensor."):
        return value
    sign = 1 if value > 0 else -1
    return sign * min(abs(_STEP * value), abs(largest(name, sign, laws)))
