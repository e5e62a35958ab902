"""The velocity before contact from one that was integrated to the peak of the force, where the
target gives way.

At first contact and when the bodies part, the indentation is zero, or what of it has not sprung
back. So the way of the impactor over the contact is that of the target's surface: with F the force,
T the contact time, m the mass,

    v T - (1/m) int_0^T (T - t) F dt = Y J + delta_r,

J the impulse, Y the mobility of the target, Y J the way of a surface that gives way with Y F,
delta_r the indentation that is left (Johnson, Contact Mechanics, 1985, ch. 11; Zener, Phys. Rev. 59
(1941) 669, for Y = 1 / Z). The mass is that which the integrated velocity and the force give: m =
J_c / v_i, J_c the impulse until the peak. Then

    v = (G v_i + Y J / T) / (1 - q / 2.943),  G = (1 - c) J / J_c,

c the centroid of the pulse over T, and q = delta_r over the deepest indentation of Hertz' impact,
which lasts T = 2.943 times that over v. At the peak itself the balance is v = v_i + Y F only where
the indentation stands still there; a viscous contact has its peak earlier, and that balance is then
wrong by up to a factor of three.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ..contact_interface import ImpactBatch
from .impacts import impedance

#: Contact time of Hertz' impact times its velocity, over the deepest indentation.
_HERTZ = 2.943
#: Mobility over that of the plate without edges: uniform on (0, 2), an echo returning some of the
#: loss and an edge adding to it (2.3 on a free edge; `contact.plate_compliance`).
_SHARE, _SHARE_U = 1.0, 2 / np.sqrt(12)
#: With an anvil, times a factor that is uniform on (0, 1): the mass of the anvil, which nobody
#: states, holds it back.
_ANVIL = 0.5
_ANVIL_SHARE_U = float(np.sqrt((_SHARE**2 + _SHARE_U**2) / 3 - (_SHARE * _ANVIL) ** 2))
#: Indentation left over the deepest one, uniform on (0, 0.5): the range that yield and viscous loss
#: of the catalogue, each over its likely range, leave behind tips of metal (0 to 0.3) and of
#: polymers (0.05 to 0.6).
_UNRECOVERED, _UNRECOVERED_U = 0.25, 0.5 / float(np.sqrt(12))
#: The pulse is refined for its peak, which lies between two of 20 points.
_POINTS = 201


@dataclass(frozen=True, eq=False)
class TargetMotion:
    """How the targets of n impacts give way, arrays (n,): mobility (m/s per N), and the share of
    the deepest indentation that is left when the bodies part; each with its standard
    uncertainty."""

    mobility_m_n_s: Floats
    mobility_u_m_n_s: Floats
    unrecovered: Floats
    unrecovered_u: Floats

    @classmethod
    def of(cls, plate_impedance_n_s_m: Floats, anvil: NDArray[np.bool_]) -> Self:
        """Of plates without edges (`impacts.plate_impedance`), on some of which an `anvil` lies;
        both (n,)."""
        share = np.where(anvil, _SHARE * _ANVIL, _SHARE)
        share_u = np.where(anvil, _ANVIL_SHARE_U, _SHARE_U)
        unrecovered = np.full(len(anvil), _UNRECOVERED)
        return cls(
            share / plate_impedance_n_s_m,
            share_u / plate_impedance_n_s_m,
            unrecovered,
            np.full(len(anvil), _UNRECOVERED_U),
        )

    @classmethod
    def of_strikes(cls, strikes: ImpactBatch) -> Self:
        """Of the plates and anvils of settings."""
        return cls.of(
            impedance(strikes),
            np.array([setting.anvil is not None for setting in strikes.settings]),
        )

    def drawn(self, z: Floats) -> Self:
        """Random ones, uniform, of normal numbers `z` (n, 2): never below zero, and without an
        uncertainty."""
        from scipy.special import ndtr

        none = np.zeros(len(z))
        about = np.sqrt(3) * (2 * ndtr(z) - 1)  # uniform, of mean 0 and deviation 1
        mobility = np.maximum(self.mobility_m_n_s + about[:, 0] * self.mobility_u_m_n_s, 0.0)
        unrecovered = np.maximum(self.unrecovered + about[:, 1] * self.unrecovered_u, 0.0)
        return type(self)(mobility, none, unrecovered, none)

    @property
    def column(self) -> Self:
        """The same as (n, 1), to be broadcast over several velocities of each target."""
        return type(self)(
            self.mobility_m_n_s[:, None],
            self.mobility_u_m_n_s[:, None],
            self.unrecovered[:, None],
            self.unrecovered_u[:, None],
        )


@dataclass(frozen=True, eq=False)
class PulseMoments:
    """What of n pulses the balance needs, (n,): the factor G of the integrated velocity, and J / T
    (N)."""

    factor: Floats
    mean_force_n: Floats

    @classmethod
    def of(cls, force_n: Floats) -> Self:
        """Of forces (n, p) at equal phases of the contact; the integral ends at the peak between
        two of them."""
        from scipy.interpolate import Akima1DInterpolator

        phase = np.linspace(0.0, 1.0, _POINTS)
        dense = Akima1DInterpolator(np.linspace(0.0, 1.0, force_n.shape[1]), force_n, axis=1)(phase)
        dense = np.maximum(dense, 0.0)
        until = np.concatenate(
            [np.zeros((len(dense), 1)), (dense[:, 1:] + dense[:, :-1]).cumsum(axis=1)], axis=1
        )
        mean = np.trapezoid(dense, phase, axis=1)
        unrecovered = np.trapezoid(dense * (1 - phase), phase, axis=1)
        to_peak = until[np.arange(len(dense)), dense.argmax(axis=1)] * (phase[1] / 2)
        return cls(unrecovered / to_peak, np.asarray(mean))


def velocity_before_contact(
    integrated_m_s: Floats,
    pulses: PulseMoments,
    motion: TargetMotion,
    integrated_u_m_s: Floats | None = None,
) -> tuple[Floats, Floats]:
    """Velocity before contact and its standard uncertainty, from velocities integrated to the peak;
    all (n,).

    Never below the integrated velocity. The uncertainty is the GUM's: of the mobility, of the
    indentation left and of the integrated velocity. Arrays of other shapes are broadcast.
    """
    whole = 1 - motion.unrecovered / _HERTZ
    velocity = (
        pulses.factor * integrated_m_s + motion.mobility_m_n_s * pulses.mean_force_n
    ) / whole
    own_u = 0.0 if integrated_u_m_s is None else pulses.factor * integrated_u_m_s
    mobility_u = motion.mobility_u_m_n_s * pulses.mean_force_n
    left_u = velocity * motion.unrecovered_u / _HERTZ
    uncertainty = np.sqrt(own_u**2 + mobility_u**2 + left_u**2) / whole
    return np.maximum(velocity, integrated_m_s), np.asarray(uncertainty)


def integrated_velocity(
    before_contact_m_s: Floats, pulses: PulseMoments, motion: TargetMotion
) -> tuple[Floats, Floats]:
    """The inverse of `velocity_before_contact`: what an integral to the peak gives, and its
    standard uncertainty; (n,).

    Between a tenth of the velocity and all of it.
    """
    whole = 1 - motion.unrecovered / _HERTZ
    kept = (
        whole * before_contact_m_s - motion.mobility_m_n_s * pulses.mean_force_n
    ) / pulses.factor
    mobility_u = motion.mobility_u_m_n_s * pulses.mean_force_n
    uncertainty = (
        np.hypot(mobility_u, before_contact_m_s * motion.unrecovered_u / _HERTZ) / pulses.factor
    )
    return np.clip(kept, 0.1 * before_contact_m_s, before_contact_m_s), np.asarray(uncertainty)


def with_plate_motion(
    integrated_m_s: float,
    integrated_u_m_s: float,
    force_n: Floats,
    plate_impedance_n_s_m: float,
    anvil: bool,
) -> tuple[float, float]:
    """`velocity_before_contact` of one impact on a plate without edges, with the force (p,) at
    equal phases."""
    motion = TargetMotion.of(np.array([plate_impedance_n_s_m]), np.array([anvil]))
    speed, speed_u = np.array([integrated_m_s]), np.array([integrated_u_m_s])
    velocity, uncertainty = velocity_before_contact(
        speed, PulseMoments.of(force_n[None]), motion, speed_u
    )
    return float(velocity[0]), float(uncertainty[0])
