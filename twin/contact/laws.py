"""The nominal laws of contact by name.

Hunter's pulse: half a sine over the contact time of Hertz' sphere.

Reed's pulse: a sine to the power 3/2 that has the peak of Hertz' sphere.

The asymmetric von Hann pulse: compression as long as Hertz', restitution shorter by the coefficient
of restitution.

Glossary: m impactor's mass, u impact velocity, e coefficient of restitution, tau_el and tau_an
times of compression and restitution.

Hunt and Crossley's impact: Hertz' spring with a damping that grows with the indentation.

Glossary: m impactor's mass, u impact velocity, k and l as for Hertz, a damping number, e
restitution.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial

import numpy as np

from ...array_types import Floats
from .bodies import Bodies
from .hertz import (
    DampingLaw,
    contact_time,
    hertz,
    length_scale,
    matched_damping,
    motion,
    restitution_of,
)
from .pulse import ContactPulse, Law
from .restitution_laws import RestitutionLaw, elastic, weir_tallon, zener


def hunt_crossley(
    bodies: Bodies, restitution: RestitutionLaw = zener, damping: DampingLaw = matched_damping
) -> ContactPulse:
    """m x'' = -k x^1.5 (1 + a x' / u), eq. 1.21; the force has no jump at either end.

    Where e is small the bodies part slowly: the contact lasts about as 1/e, most of it with next to
    no force.

    Parameters:
        bodies: n impacts.
        restitution: The law of restitution, which gives e for each impact; Zener's by default.
        damping: Gives the damping number a of an e. The thesis's a = (3/2) (1 - e)
            (`low_loss_damping`) loses less than e says; the default, `matched_damping`, ends with e
            itself, so that the impulse is (1 + e) m u.

    Raises:
        MissingQuantityError: Where `impactor_mass_kg`, or what the restitution needs, is unknown.
    """
    law = "Hunt and Crossley's impact"
    e = restitution(bodies)
    velocity = bodies.impact_velocity_m_s
    momentum = bodies.needed("impactor_mass_kg", law) * velocity
    length = length_scale(bodies, law)
    ends_with = restitution_of(damping(e.value))
    unit_impact = motion(ends_with)
    return ContactPulse(
        contact_time_s=unit_impact.contact_time * length / velocity,
        compression_time_s=unit_impact.compression_time * length / velocity,
        peak_force_n=np.asarray(unit_impact.peak_force * momentum * velocity / length),
        impulse_n_s=(1 + ends_with) * momentum,
        restitution=e,
        shape=unit_impact.shape,
    )


def sphere_contact_time(bodies: Bodies) -> Floats:
    """Contact time (s, (n,)) of a sphere of the tip's radius and density.

    tau = 4.53 [(4/3) pi rho_s (d_s + d_p)]^(2/5) R u^(-1/5), d = (1 - nu^2) / (pi E): Hertz' time
    with the sphere's own mass, to the three digits of 4.53 (4.534).

    Parameters:
        bodies: n impacts.

    Source:
        Eq. 1.23.
    """
    inertia = 4 / 3 * np.pi * bodies.impactor_density_kg_m3 * bodies.compliance_1_pa / np.pi
    return np.asarray(
        4.53 * inertia**0.4 * bodies.impactor_radius_m * bodies.impact_velocity_m_s**-0.2
    )


def hunter(bodies: Bodies) -> ContactPulse:
    """F = F_max sin(pi t / tau), eq. 1.22, with F_max = pi m_s u / tau of the sphere's mass m_s.

    The thesis gives no F_max for it; this one returns the sphere's momentum, 2 m_s u. (Two
    conventions in use: the second derivative of a sinusoidal indentation, 1.140 m u^2 / delta
    against 1.067 here, and Hertz' peak itself, 1.25. Neither conserves momentum.) Without loss; the
    impactor's mass beyond the tip's does not enter.

    Parameters:
        bodies: n impacts.

    Source:
        Hunter, J. Mech. Phys. Solids 5 (1957) 162.
    """
    time = sphere_contact_time(bodies)
    momentum = bodies.sphere_mass_kg * bodies.impact_velocity_m_s
    return ContactPulse(
        contact_time_s=time,
        compression_time_s=time / 2,
        peak_force_n=np.pi * momentum / time,
        impulse_n_s=2 * momentum,
        restitution=elastic(bodies),
        shape=lambda phase: np.sin(np.pi * phase)[None, :],
    )


#: Mean of sin^1.5 over half a period, 0.5564.
_MEAN = math.gamma(1.25) / (math.gamma(1.75) * math.sqrt(math.pi))


def reed(bodies: Bodies) -> ContactPulse:
    """F = F_max sin^1.5(pi t / tau), eq. 1.24 with the contact time of eq. 1.23 and F_max of eq.
    1.25.

    F_max = 1.917 rho_s^(3/5) (d_s + d_p)^(-2/5) R^2 u^(6/5), d = (1 - nu^2) / (pi E). Peak and time
    are Hertz' own, the shape is not quite: the impulse is 2.3 % above 2 m_s u, the most that a
    sphere can give. Without loss; the impactor's mass beyond the tip's does not enter.

    Parameters:
        bodies: n impacts.

    Source:
        Reed, J. Phys. D 18 (1985) 2329.
    """
    time = sphere_contact_time(bodies)
    velocity, density = bodies.impact_velocity_m_s, bodies.impactor_density_kg_m3
    softness = (bodies.compliance_1_pa / np.pi) ** -0.4
    peak = 1.917 * density**0.6 * softness * bodies.impactor_radius_m**2 * velocity**1.2
    return ContactPulse(
        contact_time_s=time,
        compression_time_s=time / 2,
        peak_force_n=np.asarray(peak),
        impulse_n_s=_MEAN * peak * time,
        restitution=elastic(bodies),
        shape=lambda phase: np.sin(np.pi * phase)[None, :] ** 1.5,
    )


def von_hann(bodies: Bodies, restitution: RestitutionLaw = zener) -> ContactPulse:
    """Two halves of a raised cosine, eq. 1.26 to 1.28: tau_el = tau / 2, tau_an = e tau_el, F_max =
    2 m u / tau_el.

    Impulse of the compression m u, of the whole (1 + e) m u. Errata: eq. 1.26 prints u^2 for
    u^(1/2) (Hertz' time); the second line of eq. 1.28 divides by tau_el, which neither meets the
    first line nor ends at zero unless e = 1: it is tau_an.

    Parameters:
        bodies: n impacts.
        restitution: The law of restitution, which gives e for each impact; Zener's by default.

    Raises:
        MissingQuantityError: Where `impactor_mass_kg`, or what the restitution needs, is unknown.
    """
    e = restitution(bodies)
    momentum = bodies.needed("impactor_mass_kg", "the von Hann pulse") * bodies.impact_velocity_m_s
    compression = contact_time(bodies) / 2
    return ContactPulse(
        contact_time_s=compression * (1 + e.value),
        compression_time_s=compression,
        peak_force_n=2 * momentum / compression,
        impulse_n_s=(1 + e.value) * momentum,
        restitution=e,
        shape=lambda phase: _raised_cosine(phase, e.value),
    )


def _raised_cosine(phase: Floats, restitution: Floats) -> Floats:
    """n x p; the time is in units of tau_el, and runs 1/e times as fast after the peak."""
    e = restitution[:, None]
    time = phase[None, :] * (1 + e)
    return np.asarray((1 - np.cos(np.pi * np.where(time <= 1, time, 1 + (time - 1) / e))) / 2)


#: Laws that lose energy, as much as a law of restitution says.
LOSSY: Mapping[str, Callable[..., ContactPulse]] = {
    "hann": von_hann,
    "hunt-crossley": hunt_crossley,
}
ELASTIC: Mapping[str, Law] = {"hunter": hunter, "reed": reed, "hertz": hertz}
RESTITUTIONS: Mapping[str, RestitutionLaw] = {"zener": zener, "weir-tallon": weir_tallon}

#: Every law, ready to be asked; those that lose energy lose it as Zener says.
LAWS: Mapping[str, Law] = {**ELASTIC, **LOSSY}


def contact_law(name: str, restitution: str | None = None) -> Law:
    """A law by name, with a law of restitution of one's choice.

    Parameters:
        name: Name of the law, one of `LAWS`.
        restitution: Name of a law of restitution, one of `RESTITUTIONS`, for a law that loses
            energy; by default None, which is Zener's for these.

    Raises:
        LookupError: For names there are none of.
        ValueError: Where a law without loss is given a restitution.
    """
    if name not in LAWS:
        raise LookupError(f"no law of contact {name!r}; there are: {', '.join(LAWS)}")
    if restitution is None:
        return LAWS[name]
    if restitution not in RESTITUTIONS:
        raise LookupError(
            f"no law of restitution {restitution!r}; there are: {', '.join(RESTITUTIONS)}"
        )
    if name not in LOSSY:
        raise ValueError(
            f"restitution {restitution!r} for {name!r}, a law without loss: expected none"
        )
    return partial(LOSSY[name], restitution=RESTITUTIONS[restitution])
