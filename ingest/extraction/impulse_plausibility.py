"""Impulse over mass times velocity: of one pulse, and of a whole campaign, whose impulses are off
by one known factor where a unit is wrong (lbf as N, a gain).

A mass m that arrives with u leaves with -e u, 0 <= e <= 1: the impulse is m u (1 + e), between m u
and 2 m u, as long as what it hits hardly moves in the contact. A plate that is not heavy takes its
share: with the plate's mass M free to move, it is m M / (m + M) that counts, and the impulse is
smaller; a hand that holds a hammer makes it larger, up to 3 m u. A velocity that is integrated from
the impactor's own deceleration is that of the contact alone, .32 to .82 of the impact's: 168
impacts of correct virtual campaigns have ratios of 1.8 to 4.2 by it. Cells behind an anvil show up
to twice the impulse.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...signals.checks.base import Finding
from ..errors import IngestError
from ..folder.bench_rules import UNIT_FACTOR
from ..folder.unit_mistakes import unit_mistakes
from .pulses import ExtractedPulse

#: Half of m u is what a free plate as light as the impactor takes, where its mass is not known. Of
#: a known one the other half is for bending: a plate answers with less than its mass while the
#: contact lasts.
LOWEST_RATIO = 0.5
#: A hand adds to a hammer's head: a campaign with an effective mass of 1.3 times the head's was
#: disclosed. What flies free has nothing to add, but the gas still drives a bullet behind the laser
#: (by up to a fifth on the virtual gun); 15 % are for velocity and calibration.
HIGHEST_RATIO_HELD, HIGHEST_RATIO_FREE = 3.0, 2.8
#: Cells behind an anvil: a mass on a spring that is struck pushes on the spring with twice the
#: impulse before it pulls (measured on the virtual gun, light bullets: up to 3.7 times mass times
#: velocity).
ANVIL_FACTOR, HIGHEST_RATIO_ANVIL = 2.0, 4.6
#: What an integrated velocity is of the impact's at least: the impactor's deceleration is that of
#: the contact alone.
LEAST_INTEGRATED_SHARE = 0.32
#: From this factor outside of the range on, mass, velocity, unit or sensitivity is wrong.
REJECT_FACTOR = 3.0
#: A rounded tip that is sharper than this is no tip of an impactor: a needle's point, or a unit (mm
#: for m).
SMALLEST_RADIUS_M = 0.5e-3
#: Ratios of correct campaigns by velocities that are reported or measured, and by integrated ones.
USUAL, USUAL_ANVIL, USUAL_INTEGRATED = (0.5, 3.0), (0.5, 4.6), (1.0, 7.0)
#: No contact of an impact lasts so long, and none is as short as the other (s): the sampling rate
#: is another one.
LONGEST_CONTACT_S, SHORTEST_CONTACT_S = 0.1, 4e-6
#: So many impacts are judged, so large a share of them must be off, and so large a share right with
#: the factor.
LEAST_IMPACTS, OFF_SHARE, RIGHT_SHARE = 3, 2 / 3, 0.9
#: So many impacts are held back before the first of them is stored.
ENOUGH_IMPACTS = 12


def check_impulse(
    pulse: ExtractedPulse,
    mass_kg: float,
    velocity_m_s: float,
    contact: int | None,
    channel: str,
    *,
    held: bool,
    integrated: bool = False,
    behind_anvil: bool = False,
    plate_mass_kg: float | None = None,
) -> Finding | None:
    """An impulse outside of m u to 2 m u; None inside (with margins), and for a velocity or a mass
    that is not above zero. `held`: by a hand, as a hammer is; `integrated`: the velocity is, which
    the upper limit allows for; `behind_anvil`: the force is measured behind an anvil that is
    struck. A plate of known mass takes its share of the lower limit."""
    momentum = mass_kg * velocity_m_s
    if momentum <= 0.0:
        return None
    ratio = pulse.impulse_n_s / momentum
    share = 1.0 if plate_mass_kg is None else plate_mass_kg / (plate_mass_kg + mass_kg)
    slower = LEAST_INTEGRATED_SHARE if integrated else 1.0
    highest = (
        HIGHEST_RATIO_ANVIL if behind_anvil else HIGHEST_RATIO_HELD if held else HIGHEST_RATIO_FREE
    )
    limits = (LOWEST_RATIO * share, highest / slower)
    expected = (share, 2.0 * (ANVIL_FACTOR if behind_anvil else 1.0) / slower)
    if limits[0] <= ratio <= limits[1]:
        return None
    far = ratio < share / REJECT_FACTOR or ratio > 2.0 * REJECT_FACTOR / slower
    evidence = {
        "impulse_n_s": pulse.impulse_n_s,
        "mass_kg": mass_kg,
        "impact_velocity_m_s": velocity_m_s,
        "impulse_over_momentum": ratio,
        "plate_mass_kg": plate_mass_kg,
        "expected": list(expected),
        "limits": list(limits),
    }
    message = (
        f"an impulse of {pulse.impulse_n_s:.3g} N s is {ratio:.2g} times mass times velocity "
        f"({mass_kg:.3g} kg, {velocity_m_s:.3g} m/s), where {expected[0]:.2g} to {expected[1]:.2g} "
        "are possible: look at mass, velocity, unit and sensitivity of the force"
    )
    return Finding(
        "implausible-impulse", "reject" if far else "warning", message, channel, evidence, contact
    )


def check_tip(radius_m: float | None, contact: int | None, channel: str) -> Finding | None:
    """A tip that is sharper than any."""
    if radius_m is None or radius_m >= SMALLEST_RADIUS_M:
        return None
    message = (
        f"a tip radius of {radius_m * 1e3:.3g} mm is smaller than {SMALLEST_RADIUS_M * 1e3:g} mm: "
        "look whether runs.csv gives it in mm"
    )
    evidence = {"tip_radius_m": radius_m, "limit_m": SMALLEST_RADIUS_M}
    return Finding("implausible-tip", "warning", message, channel, evidence, contact)


@dataclass(frozen=True)
class MomentumRatio:
    """Impulse over mass times velocity of one impact; `integrated`: by the impactor's own
    acceleration.

    `share`: of the plate's mass in both masses, by which a light plate lowers the ratio.
    `behind_anvil`: the force is measured behind an anvil. `by_laser`: the velocity is the bullet's
    length over the time in the laser's beam.
    """

    ratio: float
    integrated: bool
    share: float = 1.0
    behind_anvil: bool = False
    by_laser: bool = False

    def is_usual(self, factor: float = 1.0) -> bool:
        """Whether the ratio is that of a correct campaign once its readings are divided by
        `factor`."""
        low, high = (
            USUAL_INTEGRATED if self.integrated else USUAL_ANVIL if self.behind_anvil else USUAL
        )
        return low * self.share <= self.ratio / factor <= high


def refuse_wrong_unit(campaign: str, ratios: Sequence[MomentumRatio]) -> None:
    """Raise `IngestError` where most `ratios` of a campaign are off, and one known factor explains
    them."""
    off = [ratio for ratio in ratios if not ratio.is_usual()]
    if len(ratios) < LEAST_IMPACTS or len(off) < OFF_SHARE * len(ratios):
        return
    fitting = [
        (factor, words)
        for factor, words in _mistakes(ratios)
        if sum(ratio.is_usual(factor) for ratio in ratios) >= RIGHT_SHARE * len(ratios)
    ]
    if not fitting:
        return
    middle = sorted(ratio.ratio for ratio in ratios)[len(ratios) // 2]
    usual = 2.0 if ratios[0].integrated else 1.4
    fitting.sort(key=lambda mistake: max(middle / mistake[0] / usual, usual * mistake[0] / middle))
    factor, words = fitting[0]
    others = "; ".join(dict.fromkeys(f"{text} ({value:.4g})" for value, text in fitting[1:4]))
    raise IngestError(
        f"{campaign}: impulses are {middle:.3g} times mass times velocity in "
        f"the median of {len(ratios)} impacts, "
        f"{len(off)} of which are impossible; a factor of {factor:.4g} explains them: {words}"
        + (f"; or {others}" if others else "")
        + ". Correct unit or sensitivity of the channel in campaign.toml (or mass and velocity in "
        f"runs.csv); where all are right, confirm it with --confirm {UNIT_FACTOR} or with "
        f'confirmed = ["{UNIT_FACTOR}"] in [bench] of campaign.toml'
    )


def refuse_wrong_clock(campaign: str, contact_times_s: Sequence[float]) -> None:
    """Raise `IngestError` where most contacts of a campaign are a thousand times too long or too
    short."""
    if len(contact_times_s) < LEAST_IMPACTS:
        return
    middle = sorted(contact_times_s)[len(contact_times_s) // 2]
    if SHORTEST_CONTACT_S <= middle <= LONGEST_CONTACT_S:
        return
    slow = middle > LONGEST_CONTACT_S  # the sampling rate reads too low
    factor, words = next(
        mistake for mistake in unit_mistakes("clock") if (mistake[0] < 1.0) == slow
    )
    raise IngestError(
        f"{campaign}: contacts last {middle:.3g} s in the median of {len(contact_times_s)} "
        f"impacts, which no impact does; a factor of {1.0 / factor:.4g} explains it: sampling "
        f"rate: {words}, or times in {'ms where s' if slow else 's where ms'} is declared. Correct "
        "the sampling rate or the unit of the time in the recordings or in campaign.toml; where it "
        f"is right, confirm it with --confirm {UNIT_FACTOR} or with "
        f'confirmed = ["{UNIT_FACTOR}"] in [bench] of campaign.toml'
    )


def _mistakes(ratios: Sequence[MomentumRatio]) -> list[tuple[float, str]]:
    """Factors on the ratio, each with the mistake that makes it."""
    mistakes = [(factor, f"force: {words}") for factor, words in unit_mistakes("force")]
    if any(ratio.integrated for ratio in ratios):
        quantity, name = "acceleration", "acceleration of the impactor"
    elif any(ratio.by_laser for ratio in ratios):
        mistakes.insert(0, (1e3, "bullet length: values in m where mm is declared"))
        quantity, name = "velocity", "velocity by the laser"
    else:
        quantity, name = "velocity", "impact velocity"
    mistakes += [(1.0 / factor, f"{name}: {words}") for factor, words in unit_mistakes(quantity)]
    mistakes += [
        (1e-3, "mass: values in g where kg is declared"),
        (1e3, "mass: values in kg where g is declared"),
    ]
    return mistakes
