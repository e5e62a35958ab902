"""Which pulses of which campaigns enter a dataset, and what is left out and why."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from ..schema.campaigns import Campaign, Factor
from ..schema.impacts import ExtractionSettingsRow
from ..schema.known_factors import BY_NAME
from ..schema.listings import get_campaign_id
from .build_table import Member, MissingError, member_of, table_of
from .missing_facts import missing_facts, missing_words
from .predictors import PredictorSet, shipped
from .quality_filter import verdicts
from .rows import Row, force_hashes, levels_of, materials_of, rows_of_campaigns
from .sources import FACTOR, Materials
from .table import POINTS, PulseTable
from .velocities import CHOICES, converted, definition_of, one_kind

#: Of a definition; an older software refuses a newer one.
FORMAT = 1
_REASONS_TOLD = 5


@dataclass(frozen=True, eq=False)
class DatasetDraft:
    """A dataset that is not frozen yet."""

    predictors: PredictorSet
    table: PulseTable
    definition: dict[str, Any]


def select_pulses(
    session: Session,
    campaigns: Sequence[str],
    predictors: PredictorSet | None,
    quality: str,
    extraction: str | None,
    velocity: str | None = None,
) -> DatasetDraft:
    """The usable pulses of `campaigns`. Raises as `snapshot.build_snapshot`."""
    names = sorted(set(campaigns))
    if not names:
        raise ValueError("no campaign is named; expected at least one")
    keys = [get_campaign_id(session, name) for name in names]
    chosen = _fitting(session, names, predictors)
    _check_factors(session, chosen)
    rows = rows_of_campaigns(session, keys, _extraction_id(session, extraction))
    materials = materials_of(session)
    bad = {key: f"quality: {text}" for key, text in verdicts(session, keys, rows, quality).items()}
    changed = None
    if velocity is not None:
        if velocity not in CHOICES:
            raise ValueError(f"velocity is {velocity!r}; expected one of {', '.join(CHOICES)}")
        levels = levels_of(session, (row["configuration_id"] for row in rows))
        changed = converted(rows, levels, materials, CHOICES[velocity])
        rows = changed.rows
        bad = {**changed.refused, **bad}
    members, left_out = _entering(session, rows, bad, chosen, materials)
    members = _without_twins(members, force_hashes(session, keys), left_out)
    if not members:
        levels = levels_of(session, (row["configuration_id"] for row in rows))
        facts = missing_words(missing_facts(rows, levels, chosen, materials))
        raise ValueError(f"no usable pulse in {', '.join(names)}: {_told(left_out)}{facts and f'; {facts}'}")
    entered = [member.row for member in members]
    kind = one_kind(entered) if changed is None else CHOICES.get(velocity or "")
    table = table_of(members, chosen)
    used = {name for m in members for name in (m.case.tip, m.case.target, m.case.plate) if name in materials}
    definition = {
        "format": FORMAT,
        "campaigns": names,
        "kind": chosen.kind,
        "predictors": chosen.as_json(),
        "targets": {"force_n": POINTS, "contact_time_s": 1},
        "quality": quality,
        "velocity": definition_of(kind, changed, [row["impact_id"] for row in entered]),
        "extractions": dict(sorted(Counter(m.row["extraction"] for m in members).items())),
        # kept, for a material may be corrected later, and a frozen dataset stays as it is
        "materials": {str(name): dict(materials[str(name)]) for name in sorted(map(str, used))},
        "pulses": len(table),
        "left_out": [{"reason": reason, "impacts": count} for reason, count in sorted(left_out.items())],
    }
    return DatasetDraft(chosen, table, definition)


def _fitting(session: Session, names: Sequence[str], predictors: PredictorSet | None) -> PredictorSet:
    """The predictors, of the kind that all the campaigns are."""
    kinds: dict[str, str] = {}
    for name in names:
        kinds[name] = session.scalars(select(Campaign.kind).where(Campaign.name == name)).one()
    if predictors is None:
        if len(set(kinds.values())) > 1:
            raise ValueError(f"campaigns of two kinds ({_pairs(kinds)}) have no predictors in common: take one kind")
        return shipped(next(iter(kinds.values())))
    others = {name: kind for name, kind in kinds.items() if kind != predictors.kind}
    if others:
        raise ValueError(
            f"predictors {predictors.name!r} are for campaigns of kind {predictors.kind!r}, not {_pairs(others)}; "
            f"take others: --predictors {next(iter(others.values()))}"
        )
    return predictors


def _pairs(kinds: dict[str, str]) -> str:
    return ", ".join(f"{name}: {kind}" for name, kind in kinds.items())


def _check_factors(session: Session, predictors: PredictorSet) -> None:
    """Raises `LookupError` for a factor that no campaign of the store has; the thesis's may be missing in this one."""
    there = set(session.scalars(select(Factor.name)))
    for predictor, source in zip(predictors.predictors, predictors.sources, strict=True):
        name = source.removeprefix(FACTOR)
        if source.startswith(FACTOR) and name not in there and name not in BY_NAME:
            existing_names = ", ".join(sorted(there))
            raise LookupError(f"predictor {predictor.name}: no factor {name!r} in the store; known: {existing_names}")


def _extraction_id(session: Session, fingerprint: str | None) -> int | None:
    if fingerprint is None:
        return None
    settings_rows = session.execute(select(ExtractionSettingsRow.id, ExtractionSettingsRow.fingerprint)).all()
    matches = [key for key, text in settings_rows if fingerprint and text.startswith(fingerprint)]
    if len(matches) != 1:
        there = ", ".join(text[:12] for _, text in settings_rows) or "none yet"
        raise LookupError(f"{len(matches) or 'no'} extractions {fingerprint!r} in the store; there: {there}")
    return matches[0]


def _entering(
    session: Session, rows: Sequence[Row], bad: dict[int, str], predictors: PredictorSet, materials: Materials
) -> tuple[list[Member], Counter[str]]:
    """Impacts that can enter, and how many cannot, by reason."""
    levels = levels_of(session, (row["configuration_id"] for row in rows))
    members: list[Member] = []
    left_out: Counter[str] = Counter()
    for row in rows:
        try:
            if row["impact_id"] in bad and row["pulse_id"] is not None:
                raise MissingError(bad[row["impact_id"]])
            members.append(member_of(row, levels[row["configuration_id"]], predictors, materials))
        except MissingError as error:
            left_out[str(error)] += 1
    return members, left_out


def _without_twins(members: list[Member], force: Mapping[int, str], left_out: Counter[str]) -> list[Member]:
    """The first of the impacts that are one contact of one record: two would stand on both sides of every split."""
    first: dict[tuple[str, float], Member] = {}
    for member in members:
        # A pulse has a force channel; were its record gone, the raw file's hash would do.
        record = force.get(member.row["recording_id"], member.row["recording_sha256"])
        if first.setdefault((record, member.row["start_s"]), member) is not member:
            left_out["the same contact of the same record as another impact"] += 1
    return list(first.values())


def _told(left_out: Counter[str]) -> str:
    """The reasons, the most frequent first."""
    if not left_out:
        return "the campaign has no impacts (shots alone carry no force)"
    reasons = [f"{count} with {reason}" for reason, count in left_out.most_common(_REASONS_TOLD)]
    return "; ".join(reasons)
