"""Column names of `runs.csv`: those with a meaning, and those that resemble one and are probably
misspelt.

Every other column is a free factor. It needs no declaration unless its name resembles a known one:
the contract of the campaign folder keeps further columns as free factors, and plans write such
columns.
"""

from __future__ import annotations

import json
import re
from collections.abc import Collection, Mapping, Sequence

from ...schema.known_factors import BY_COLUMN, BY_NAME, KNOWN_FACTORS
from ..errors import Faults, printable

RUNS_FILE = "runs.csv"
KEYS = ("run", "repetition")
#: Columns that are measurements, not factors: (attribute of a row, scale to SI, zero allowed).
MEASURED: dict[str, tuple[str, float, bool]] = {
    "impact_velocity_m_s": ("impact_velocity_m_s", 1.0, True),
    "impact_velocity_u_m_s": ("impact_velocity_u_m_s", 1.0, True),
    "measured_velocity_m_s": ("measured_velocity_m_s", 1.0, True),
    "measured_velocity_u_m_s": ("measured_velocity_u_m_s", 1.0, True),
    "bullet_length_mm": ("bullet_length_m", 1e-3, False),
    "bullet_length_u_mm": ("bullet_length_u_m", 1e-3, True),
    "laser_sampling_rate_hz": ("laser_sampling_rate_hz", 1.0, False),
}
#: Free factors that `diagnose` gives a meaning: the projectile's own travel.
TRAVEL = ("travel_m", "travel_mm")
KNOWN = (*KEYS, "recording", *BY_COLUMN, *MEASURED, *TRAVEL)
#: A table has both keys, or is refused: no other column can be one of them misspelt ("repetitions"
#: of a plan's sheet).
_RESEMBLED = tuple(column for column in KNOWN if column not in KEYS)

#: One or two letters added, left out, changed or swapped.
_MOST_EDITS = 2
_UNIT = re.compile(r"(_(?:kg|mm|m_s|m|bar|hz))$")
#: "tank_pressure_psi" and "tank_pressure" are "tank_pressure_bar" in another unit or in none.
_STEMS = {_UNIT.sub("", column): column for column in _RESEMBLED if _UNIT.search(column)}
_OTHER_UNIT = re.compile(
    "_(?:k?g|mg|t|lb|lbs|oz|m|mm|cm|um|in|inch|ft|bar|mbar|k?pa|mpa|psi|atm|k?hz|m_s|ms|mps|mm_s|"
    "ft_s|fps|km_h|kmh)"
)
_STEMS |= {factor.name: factor.column for factor in KNOWN_FACTORS if factor.is_number}


def check_columns(
    header: Sequence[str],
    declared: Mapping[str, str],
    confirmed: Collection[str],
    table: str = RUNS_FILE,
) -> None:
    """Refuse a column that resembles a known one, unless campaign.toml declares it or the user
    confirmed it.

    `declared` and `confirmed` are free factors by their columns, `table` the file's name. Raises
    `IngestError` with the suggestion, and for a declaration that the table does not bear out.
    """
    faults = Faults()
    for place, columns in (("campaign.toml: [factors]", declared), ("--free-factor", confirmed)):
        for column in columns:
            if column in KNOWN:
                faults.add(
                    [
                        f"{place}: {column!r} is a known column "
                        f"of {table}, not a free factor; remove it"
                    ]
                )
            elif column not in header:
                there = printable(", ".join(header))
                faults.add(
                    [
                        f"{place}: {printable(column)} is no "
                        f"column of {table}; its columns are {there}"
                    ]
                )
    for column in header:
        similar = resembled(column)
        if similar is not None and column not in declared and column not in confirmed:
            faults.add(
                [
                    f"{table}: column {printable(column)} resembles the known column {similar!r}; "
                    "correct its name, or, if it is a factor of its own, declare it in "
                    f'campaign.toml ([factors], {_toml_key(column)} = "what it is") or confirm it '
                    f"with --free-factor {_argument(column)}"
                ]
            )
    faults.refuse()


def resembled(column: str) -> str | None:
    """The known column that a name resembles by case, blanks, unit or up to two letters; None for
    any other name."""
    if column in KNOWN:
        return None
    plain = _plain(column)
    of_unit = _STEMS.get(plain) or next(
        (_STEMS[s] for s in _STEMS if _is_other_unit(plain, s)), None
    )
    if of_unit is not None:
        return of_unit
    letters = plain.replace("_", "")
    nearest = min(_RESEMBLED, key=lambda known: _edits(letters, known.replace("_", "")))
    return nearest if _edits(letters, nearest.replace("_", "")) <= _MOST_EDITS else None


def resembled_channel(channel: str, others: Collection[str]) -> str | None:
    """The one of `others` that may be `channel` in another spelling; None where there is none.

    Case, blanks, a unit and a letter or two do not count, as for columns; a letter of a short name
    does, and so does a number: acc_2 is another channel than acc_3.
    """
    plain = _plain(channel)
    for other in others:
        given = _plain(other)
        if re.findall(r"\d+", given) != re.findall(r"\d+", plain):
            continue
        first, second = plain.replace("_", ""), given.replace("_", "")
        most = min(_MOST_EDITS, len(first) // 3)
        if (
            _edits(first, second) <= most
            or _is_other_unit(given, plain)
            or _is_other_unit(plain, given)
        ):
            return other
    return None


def undeclared(factors: Collection[str], declared: Collection[str]) -> list[str]:
    """Factors that neither have a known meaning nor a declaration, in their order."""
    return [
        name
        for name in factors
        if name not in BY_NAME and name not in TRAVEL and name not in declared
    ]


def _is_other_unit(plain: str, stem: str) -> bool:
    return plain.startswith(stem) and _OTHER_UNIT.fullmatch(plain[len(stem) :]) is not None


def suggestion(column: str, header: Collection[str]) -> str:
    """For a key that is missing: the column that was probably meant, as the end of a sentence; else
    nothing."""
    for heading in header:
        if _edits(_plain(heading), column) <= 1:
            return f"; column {printable(heading)} resembles it"
    return ""


def _plain(column: str) -> str:
    """Small letters, with one underscore for whatever parts words ("Tip  material",
    "tip-material")."""
    return re.sub(r"[^a-z0-9]+", "_", column.lower()).strip("_")


def _edits(first: str, second: str) -> int:
    """Letters added, left out, changed or swapped with their neighbour (optimal string alignment);
    a name that is longer or shorter by more than `_MOST_EDITS` is told at once."""
    if abs(len(first) - len(second)) > _MOST_EDITS:
        return _MOST_EDITS + 1
    before: list[int] = []
    row = list(range(len(second) + 1))
    for i, letter in enumerate(first, 1):
        earlier, before, row = before, row, [i]
        for j, other in enumerate(second, 1):
            cost = min(before[j] + 1, row[j - 1] + 1, before[j - 1] + (letter != other))
            if i > 1 and j > 1 and (letter, first[i - 2]) == (second[j - 2], other):
                cost = min(cost, earlier[j - 2] + 1)
            row.append(cost)
    return row[-1]


def _toml_key(column: str) -> str:
    return (
        column
        if re.fullmatch(r"[A-Za-z0-9_-]+", column)
        else json.dumps(column, ensure_ascii=False)
    )


def _argument(column: str) -> str:
    return column if re.fullmatch(r"[A-Za-z0-9_-]+", column) else f"'{column}'"
