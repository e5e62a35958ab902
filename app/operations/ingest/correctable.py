"""The facts of a stored campaign that its form of corrections offers, with what is stated now and
why each is needed."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass

from sqlalchemy import select
from sqlalchemy.orm import Session

from ....ingest.folder.description_fields import COLUMN_WORDS, COLUMNS
from ....ingest.folder.typed_values import plain_text
from ....ingest.storing.corrections import OF_BENCH, OF_CAMPAIGN, OF_RUNS
from ....ingest.storing.stated_bench import stated_bench
from ....schema.campaigns import Campaign, stated_day
from ....schema.conditions import get_campaign_id
from ....schema.configurations import configuration_factors
from ....schema.impacts import Impact, Shot
from ....schema.known_factors import column_of

#: Levels of a factor that are named; of more it is said how many there are.
_MOST_LEVELS = 6


@dataclass(frozen=True)
class CorrectableFact:
    """A fact by its name, in the words of a page. `stated` is its value now ("" where there is
    none), and `missing` is how many impacts or shots lack it."""

    name: str
    label: str
    unit: str
    why: str
    stated: str
    missing: int = 0


def facts_of_campaign(session: Session, name: str) -> list[CorrectableFact]:
    """Facts of the campaign and its bench, those of its kind.

    Parameters:
        session: A session of the store.
        name: The name of the campaign.

    Raises:
        LookupError: Where there is no such campaign.
    """
    row = session.get_one(Campaign, get_campaign_id(session, name))
    bench = stated_bench(session, row)
    values = {
        "campaign.date": stated_day(row.date),
        "campaign.operator": row.operator,
        "campaign.description": row.description,
    }
    facts = []
    for key in (*OF_CAMPAIGN.values(), *OF_BENCH.values()):
        of_kind = row.kind in key.kinds or key.keys[1] in bench
        if not of_kind:
            continue
        stated = (
            values[key.name]
            if key.name in values
            else _text(bench.get(key.keys[1], {}).get(key.keys[2]))
        )
        facts.append(CorrectableFact(key.name, key.label, key.unit, key.why, stated or ""))
    return facts


def _text(value: object) -> str:
    if isinstance(value, list | tuple):
        return "; ".join(", ".join(plain_text(part) for part in corner) for corner in value)
    return plain_text(value)


def facts_of_runs(session: Session, name: str) -> list[CorrectableFact]:
    """Factors of the campaign's runs: the usual ones of its kind and those that the runs state.

    Parameters:
        session: A session of the store.
        name: The name of the campaign.

    Raises:
        LookupError: Where there is no such campaign.
    """
    row = session.get_one(Campaign, get_campaign_id(session, name))
    table = Shot if row.kind == "gun" else Impact
    query = select(table.configuration_id).where(table.campaign_id == row.id)
    keys = list(session.scalars(query))
    factors = configuration_factors(session, sorted(set(keys)))
    counts: dict[str, Counter[str]] = {}
    for key in keys:
        for factor, level in factors[key].items():
            column, scale = column_of(factor)
            counts.setdefault(column, Counter())[_level(level, scale)] += 1
    usual = [column for column in COLUMNS[row.kind] if column in OF_RUNS]
    facts = []
    for column in dict.fromkeys([*usual, *counts]):
        words, why = COLUMN_WORDS.get(column, (column, "A factor of your own."))
        levels = counts.get(column, Counter())
        facts.append(
            CorrectableFact(
                column,
                re.sub(r" \(none\)$", "", words),
                "",
                why,
                _levels_words(levels),
                len(keys) - sum(levels.values()),
            )
        )
    return facts


def _level(level: str | float, scale: float) -> str:
    if isinstance(level, str):
        return level
    return plain_text(float(f"{level / scale:.12g}"))


def _levels_words(levels: Counter[str]) -> str:
    if len(levels) == 1:
        return next(iter(levels))
    shown = ", ".join(f"{level} ({count})" for level, count in levels.most_common(_MOST_LEVELS))
    more = len(levels) - _MOST_LEVELS
    return f"{shown} and {more} more" if more > 0 else shown


def runs_of_text(text: str) -> tuple[int, ...]:
    """Runs as a person lists them: `1-4, 7`.

    Parameters:
        text: What was typed; an empty text names none.

    Raises:
        ValueError: For anything else.
    """
    runs: list[int] = []
    for part in re.split(r"[,;\s]+", text.strip()):
        if not part:
            continue
        match = re.fullmatch(r"(\d{1,9})(?:[-–](\d{1,9}))?", part)
        if match is None:
            raise ValueError(f"{part!r:.40} is no run; expected runs such as 1-4, 7")
        first, last = int(match[1]), int(match[2] or match[1])
        if not first <= last < first + 10_000:
            raise ValueError(f"{part!r:.40} is no range of runs; expected runs such as 1-4, 7")
        runs += range(first, last + 1)
    return tuple(dict.fromkeys(runs))
