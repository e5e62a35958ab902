"""What a pulse must be by the impactor's mass and velocity, and by what other recordings hold; and
what the bench cannot have, held against the rows of `runs.csv`: refused, unless confirmed by name.

A mass m that arrives with u leaves with -e u, 0 <= e <= 1: the impulse is m u (1 + e), between m u
and 2 m u, as long as what it hits hardly moves in the contact. A plate that is not heavy takes its
share: with the plate's mass M free to move, it is m M / (m + M) that counts, and the impulse is
smaller; a hand that holds a hammer makes it larger.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence

from ..schema.known_factors import BY_NAME, NONE
from ..signals.checks.base import Finding
from .channel_mistakes import unit_mistakes
from .errors import Faults, IngestError, enumerated, printable
from .folder import CampaignFile
from .pulses import ExtractedPulse
from .runs import RunRow
from .unit_plausibility import RULE as UNIT_FACTOR

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


def check_same_samples(twins: Sequence[str], channel: str) -> Finding | None:
    """A recording whose samples are those of other recordings of the campaign, `twins` by path."""
    if not twins:
        return None
    message = (
        f"holds the same samples as {twins[0]}: one recording stands for two "
        f"runs; look which run it is of"
    )
    return Finding("same-recording", "warning", message, channel, {"same_as": list(twins)})


def check_other_campaigns(places: Sequence[tuple[str, str]], channel: str) -> Finding | None:
    """A recording whose file is stored in other campaigns, too: `places` are (campaign, path)."""
    if not places:
        return None
    campaign, path = places[0]
    more = f" and {len(places) - 1} more" if len(places) > 1 else ""
    message = (
        f"this very file is stored as {path} of campaign {campaign}{more}: datasets of both would "
        "hold its impacts twice; delete one of the campaigns, or build datasets of one of them"
    )
    evidence = {"stored_as": [{"campaign": name, "recording": place} for name, place in places]}
    return Finding("same-recording", "warning", message, channel, evidence)


INSULATOR, SIZE, PRESSURE = ("insulator-without-anvil", "negative-size", "pressure-above-regulator")
RULES = (INSULATOR, SIZE, PRESSURE, UNIT_FACTOR)

#: A free factor with one of these words in its name is a size, a mass or the like: below zero there
#: is none.
_SIZES = frozenset(
    {"area", "density", "depth", "diameter", "height", "length", "mass"}
    | {"radius", "stiffness", "thickness", "travel", "volume", "weight", "width"}
)

#: As `IngestReport.findings` holds them.
Told = dict[str, str | None]


def check_bench(
    file: CampaignFile, rows: Sequence[RunRow], confirmed: Collection[str]
) -> list[Told]:
    """Findings on rows that the bench hardly has. Raises `IngestError` for rows that it cannot
    have.

    `confirmed` are rules that the user, or `confirmed` in `[bench]`, has confirmed; they are told
    all the same. Raises `IngestError` for a rule that there is not.
    """
    confirmed = {*confirmed, *file.confirmed}
    unknown = sorted(confirmed - set(RULES))
    if unknown:
        rule_names = ", ".join(RULES)
        raise IngestError(
            *(
                f"{printable(rule)} is no rule that can be confirmed; known: {rule_names}"
                for rule in unknown
            )
        )
    faults = Faults()
    runs_by_message: dict[str, list[int]] = {}
    for row in rows:
        for rule, why in _broken(file, row):
            # A hammer's pad may lie on the bare plate: the disclosed hammer campaigns have such
            # rows.
            if rule not in confirmed and not (rule == INSULATOR and file.kind == "hammer"):
                faults.add(
                    [
                        f"{row.place}: {why}; correct the row, or, if it is true, confirm it with "
                        f"--confirm {rule} or with confirmed = "
                        f'["{rule}"] in [bench] of campaign.toml'
                    ]
                )
            runs_by_message.setdefault(rule, []).append(row.line)
    faults.refuse()
    findings = [
        _finding(rule, f"{rows[0].file}: {_lines(lines)}: {_WORDS[rule]}")
        for rule, lines in runs_by_message.items()
    ]
    unjudged = [row.line for row in rows if row.recording is None and _is_impact(file, row)]
    if unjudged:
        findings.append(
            _finding(
                "not-judged",
                f"{rows[0].file}: {_lines(unjudged)} without a recording: no check can judge them",
            )
        )
    return findings


_WORDS = {
    INSULATOR: "an insulator without an anvil",
    SIZE: "a size below zero",
    PRESSURE: "a tank pressure above the regulator's limit",
}


#: No shot leaves the barrel below this pressure.
_LEAST_PRESSURE_PA = 0.05e5


def _broken(file: CampaignFile, row: RunRow) -> Iterator[tuple[str, str]]:
    """The rules that a row breaks, each with the values."""
    levels = row.levels_by_factor
    insulator, anvil = levels.get("insulator"), levels.get("anvil_material")
    if insulator and insulator.label != NONE and (anvil is None or anvil.label == NONE):
        stated = "not given" if anvil is None else repr(anvil.label)
        yield (
            INSULATOR,
            f"insulator is {insulator.label!r} and anvil_material is "
            f"{stated}; an insulator needs an anvil",
        )
    for name, level in levels.items():
        if (
            name not in BY_NAME
            and level.number is not None
            and level.number < 0
            and _SIZES & set(name.lower().split("_"))
        ):
            yield SIZE, f"column {printable(name)} is {level.label}; a size is not below zero"
    pressure, limit = row.number("tank_pressure"), file.max_regulated_pressure_pa
    if pressure is not None and pressure > limit:
        possible = [
            f"{words} ({pressure / factor / 1e5:.3g} bar)"
            for factor, words in unit_mistakes("pressure")
            if _LEAST_PRESSURE_PA <= pressure / factor <= limit
        ]
        yield (
            PRESSURE,
            f"tank_pressure_bar is {pressure / 1e5:g}, the regulator gives at most {limit / 1e5:g} "
            "bar (max_regulated_pressure_pa in [bench.gun] states another limit"
            + (f"; possible would be {' or '.join(possible)})" if possible else ")"),
        )


def _is_impact(file: CampaignFile, row: RunRow) -> bool:
    """Whether a row without a recording is stored as an impact."""
    return file.kind != "gun" or row.impact_velocity_m_s is not None


def _finding(check: str, message: str) -> Told:
    return {
        "recording": None,
        "channel": None,
        "check": check,
        "severity": "note",
        "message": message,
    }


def _lines(lines: Sequence[int]) -> str:
    return f"{'row' if len(lines) == 1 else 'rows'} {enumerated([str(line) for line in lines])}"
