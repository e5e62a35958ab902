"""From impactors, targets and effects to one chain, and to the steps that resolve it; and the
chain solved in time, with a fixed step for each impact.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ..effects import Effects
from .build import Impactor, ImpactTarget, Layer
from .chain import Chain, ContactLaw
from .echoes import PlateEchoes
from .kernel import MOBILITY, SHORT_ECHO, UNENDED, run

#: `contact.tip_geometry`: the radius at the apex of a worn tip grows by exp(0.2) with each
#: strength, and that of a pointed one (strengths below 0) by exp(0.03), with a cone in the place of
#: what is taken away.
WEAR_PER_STRENGTH, POINT_PER_STRENGTH = 0.2, 0.03
_NO_LAYER = Layer()


def hertz_time(chain: Chain, velocity_m_s: Floats) -> Floats:
    """Contact time (s, (impacts,)) of the elastic contact on a rigid target: 3.218 (m / (K sqrt
    v))^0.4.

    That is 2.868 (m^2 / (R E*^2 v))^0.2 (Johnson, Contact Mechanics, 1985, eq. 11.24).
    """
    return np.asarray(
        3.218 * (chain.mass_kg / (chain.law.stiffness * np.sqrt(velocity_m_s))) ** 0.4
    )


def assemble(
    impactors: Sequence[Impactor],
    targets: Sequence[ImpactTarget],
    effects: Effects,
    rng: np.random.Generator,
) -> Chain:
    """One chain of as many impacts as there are impactors, with this strike's scatter of hand and
    aim.

    Strength 1 of the effects: `viscous_loss`, the relaxing fraction of the materials;
    `plastic_yield`, the hardness of the softer one (at strength s, hardness over s);
    `layer_compliance` and `plate_compliance`, those of the target; `effective_mass`, +5 % for a
    hammer, +1 % for a projectile; `tip_geometry`, a worn tip of 1.2 times the radius at its apex.
    Raises `ValueError` for a strength that leaves no mass.
    """
    scatter = effects["bench.hand_scatter"] * rng.standard_normal((2, len(impactors)))
    mass = _array(
        [i.mass_kg * (1 + effects["contact.effective_mass"] * i.mass_error) for i in impactors]
    )
    mass = mass * np.exp(scatter[0] * _array([i.mass_spread for i in impactors]))
    if not np.all(mass > 0):
        raise ValueError(
            f"strength of contact.effective_mass = "
            f"{effects['contact.effective_mass']!r} leaves no mass"
        )
    radius = _array([i.tip_radius_m for i in impactors])
    radius = radius * np.exp(scatter[1] * _array([i.radius_spread for i in impactors]))
    share = _array([i.rear_fraction for i in impactors])
    tip = _array([i.tip.compliance_1_pa for i in impactors])
    face = _array([t.face.compliance_1_pa for t in targets])
    tip_share = tip / (tip + face)
    neck, neck_loss = _neck(impactors, mass, share)
    joint, joint_loss, inverse_anvil = _anvil(targets)
    layers = [t.insulator or _NO_LAYER for t in targets]
    insulated = np.array([t.insulator is not None for t in targets])
    return Chain(
        law=_law(impactors, targets, effects, radius),
        front_kg=mass * (1 - share),
        inverse_rear_1_kg=np.divide(1.0, mass * share, out=np.zeros_like(mass), where=share > 0),
        neck_n_m=neck,
        neck_n_s_m=neck_loss,
        inverse_anvil_1_kg=inverse_anvil,
        joint_n_m=joint,
        joint_n_s_m=joint_loss,
        plate_mobility_m_n_s=effects["contact.plate_compliance"]
        / _array([t.plate_impedance_n_s_m for t in targets]),
        relaxing=effects["contact.viscous_loss"]
        * _mixed(impactors, targets, tip_share, "relaxing_fraction"),
        relaxation_s=_mixed(impactors, targets, tip_share, "relaxation_time_s"),
        layer_share=effects["contact.layer_compliance"] * insulated,
        layer_n_m2=np.pi
        * radius
        * _array([y.oedometric_modulus_pa / y.thickness_m for y in layers]),
        layer_seating_n=_array([y.seating_force_n for y in layers]),
        layer_limit_m=_array([y.crushed_share * y.thickness_m for y in layers]),
        retardation_s=np.where(insulated, _array([y.retardation_time_s for y in layers]), np.inf),
    )


def _law(
    impactors: Sequence[Impactor], targets: Sequence[ImpactTarget], effects: Effects, radius: Floats
) -> ContactLaw:
    worn = effects["contact.tip_geometry"]
    share = (
        -math.expm1(-WEAR_PER_STRENGTH * worn)
        if worn > 0
        else math.expm1(POINT_PER_STRENGTH * worn)
    )
    pairs = list(zip(impactors, targets, strict=True))
    softer = _array([min(i.tip.hardness_pa, t.face.hardness_pa) for i, t in pairs])
    strength = effects["contact.plastic_yield"]
    return ContactLaw(
        modulus_pa=1 / _array([i.tip.compliance_1_pa + t.face.compliance_1_pa for i, t in pairs]),
        radius_m=radius,
        hardness_pa=softer / strength if strength > 0 else np.full_like(radius, np.inf),
        tip_height_m=_array([i.tip_height_m for i in impactors]),
        tip_share=np.full_like(radius, share),
    )


def _neck(impactors: Sequence[Impactor], mass: Floats, share: Floats) -> tuple[Floats, Floats]:
    """Stiffness and damping between front and rear: their resonance in free flight, and its damping
    ratio."""
    reduced = mass * share * (1 - share)
    circular = 2 * np.pi * _array([i.rear_resonance_hz for i in impactors])
    damping = _array([i.rear_damping for i in impactors])
    return np.asarray(reduced * circular**2), np.asarray(2 * damping * reduced * circular)


def _anvil(targets: Sequence[ImpactTarget]) -> tuple[Floats, Floats, Floats]:
    """Stiffness, damping and inverse mass, all 0 without an anvil."""
    rows = [
        (
            a.joint_stiffness_n_m,
            2 * a.joint_damping * (a.joint_stiffness_n_m * a.mass_kg) ** 0.5,
            1 / a.mass_kg,
        )
        if (a := t.anvil) is not None
        else (0.0, 0.0, 0.0)
        for t in targets
    ]
    joint, loss, inverse = np.array(rows, dtype=np.float64).T
    return joint, loss, inverse


def _mixed(
    impactors: Sequence[Impactor], targets: Sequence[ImpactTarget], tip_share: Floats, name: str
) -> Floats:
    """A property of the pair: each material by its share of the compliance."""
    tip = _array([getattr(i.tip, name) for i in impactors])
    face = _array([getattr(t.face, name) for t in targets])
    return np.asarray(tip_share * tip + (1 - tip_share) * face)


def _array(values: Sequence[float]) -> Floats:
    return np.asarray(values, dtype=np.float64)


_LONGEST = 60  # Hertz times, and
# times m / Z, the pace of an impactor that a plate slows down; a later end means that something is
# wrong
_CREEP = 12
_DAMPED_STEP = 1.2  # of the fastest time constant; the fourth-order method is stable up to 2.7
_SWINGING_STEP = 0.4  # of the radian of the fastest mode
#: Steps for which echoes are prepared at first.
_ECHO_STEPS = 2048


@dataclass(frozen=True)
class ImpactHistories:
    """Histories (steps, impacts) at j times `step_s` (impacts,).

    An impact is over after `ends` (impacts,) of the steps, in the state (states, impacts); its
    history is 0 from there on.
    """

    step_s: Floats
    ends: NDArray[np.int64]
    state: Floats
    contact_force_n: Floats
    plate_force_n: Floats
    front_m_s2: Floats
    rear_m_s2: Floats


def steps_for(chain: Chain, velocity_m_s: Floats, steps_per_contact: int) -> Floats:
    """Step (s, (impacts,)): a share of the Hertz time, less where a link of the chain is
    quicker."""
    rates = (
        steps_per_contact / hertz_time(chain, velocity_m_s),
        _pushed_plate(chain, velocity_m_s) / _DAMPED_STEP,
        chain.layer_rate / _DAMPED_STEP,
        1 / chain.relaxation_s / _DAMPED_STEP,
        np.sqrt(chain.joint_n_m * chain.inverse_anvil_1_kg) / _SWINGING_STEP,
        np.sqrt(chain.neck_n_m * (1 / chain.front_kg + chain.inverse_rear_1_kg)) / _SWINGING_STEP,
    )
    return np.asarray(1 / np.max(rates, axis=0))


def solve(
    chain: Chain, velocity_m_s: Floats, *, steps_per_contact: int, echoes: PlateEchoes | None = None
) -> ImpactHistories:
    """From first contact until every impactor has let go, of speeds (m/s, (impacts,)) above 0.

    `echoes` of the plate that all of them strike act on the contact; without them the plate has no
    edges.

    Raises `RuntimeError` when one is still pressing after a time that no impact takes.
    """
    step = steps_for(chain, velocity_m_s, steps_per_contact)
    limits = (longest_s(chain, velocity_m_s) / step).astype(np.int64)
    runs = []
    for figures, speed, pace, limit in zip(chain.figures, velocity_m_s, step, limits, strict=True):
        count, length = SHORT_ECHO, _ECHO_STEPS
        while count == SHORT_ECHO:
            answer = _echo_answer(echoes, pace, figures[MOBILITY], length)
            count, state, history = run(figures, speed, pace, limit, answer)
            length *= 2
        if count == UNENDED:
            raise RuntimeError(
                f"an impact at {float(speed)!r} m/s has not ended after {limit} steps"
            )
        runs.append((state, history))
    ends = np.array([history.shape[1] for _, history in runs])
    histories = np.zeros((4, ends.max(), ends.size))
    for index, (_, history) in enumerate(runs):
        histories[:, : history.shape[1], index] = history
    return ImpactHistories(step, ends, np.stack([state for state, _ in runs], axis=1), *histories)


def _echo_answer(
    echoes: PlateEchoes | None, step_s: float, mobility_m_n_s: float, length: int
) -> Floats:
    """The echo (m/s) of 1 N that acts for one step, at `length` steps from then on; none for a
    plate without edges."""
    if echoes is None:
        return np.empty(0)
    strength = mobility_m_n_s * echoes.plate_impedance_n_s_m
    time_s = np.asarray(step_s * np.arange(length), dtype=np.float64)
    return strength * step_s * echoes.answer(time_s)


def contact_forces(
    impactors: Sequence[Impactor],
    targets: Sequence[ImpactTarget],
    effects: Effects,
    velocities_m_s: Floats,
    rng: np.random.Generator,
    *,
    steps_per_contact: int = 250,
) -> list[tuple[float, Floats]]:
    """Of each impact the step (s) and the force (n,) in N between tip and target, from first
    contact until it lets go.

    Raises `RuntimeError` as `strike_many` does.
    """
    chain = assemble(impactors, targets, effects, rng)
    solution = solve(chain, velocities_m_s, steps_per_contact=steps_per_contact)
    histories = zip(solution.step_s, solution.ends, solution.contact_force_n.T, strict=True)
    return [(float(step), force[:end].copy()) for step, end, force in histories]


def longest_s(chain: Chain, velocity_m_s: Floats) -> Floats:
    """A time (s, (impacts,)) that no impact takes."""
    creeping = _CREEP * chain.mass_kg * chain.plate_mobility_m_n_s
    return np.asarray(_LONGEST * hertz_time(chain, velocity_m_s) + creeping)


def _pushed_plate(chain: Chain, velocity_m_s: Floats) -> Floats:
    """How fast (1/s) the plate gives way to what pushes it: the joint of an anvil, or the contact
    at its stiffest."""
    law = chain.law
    deepest = velocity_m_s * np.maximum(
        hertz_time(chain, velocity_m_s) / 2.943,
        np.sqrt(2 * chain.mass_kg / np.maximum(law.plastic_slope, 1.0)),
    )
    contact = (
        (1 + chain.relaxing) * law.correction(deepest) * 1.5 * law.stiffness * np.sqrt(deepest)
    )
    return np.asarray(
        np.where(chain.joint_n_m > 0, chain.joint_n_m, contact) * chain.plate_mobility_m_n_s
    )
