"""What the bench cannot have, held against the rows of `runs.csv`: refused, unless confirmed by
name."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence

from ...schema.known_factors import BY_NAME, NONE
from ..errors import Faults, IngestError, enumerated, printable
from .campaign_file import CampaignFile
from .runs_table import RunRow
from .unit_mistakes import unit_mistakes

INSULATOR, SIZE, PRESSURE = ("insulator-without-anvil", "negative-size", "pressure-above-regulator")
#: Confirmed by a laboratory whose units are right though its impulses look wrong
#: (`extraction.impulse_plausibility`).
UNIT_FACTOR = "unit-factor"
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
