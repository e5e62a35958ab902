"""Which pulses of which campaigns enter a dataset, and what is left out and why.

The quality verdicts, obeyed: which impacts a rule leaves out, and which check said so.

An impact answers for what was found on itself, and for what was found on the whole of its recording
or of a channel that its numbers come from: the force, and the impactor's accelerometer where the
velocity was integrated.

Facts that predictors ask for and impacts lack: how many lack which, and where each is written down.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from ..schema.campaigns import Campaign, Factor
from ..schema.impacts import (
    INTEGRATED,
    TARGET_MOTION_ADDED,
    ExtractionSettingsRow,
    Impact,
    velocity_kind,
)
from ..schema.known_factors import BY_NAME, column_of
from ..schema.listings import get_campaign_id
from ..schema.recordings import QualityFinding, RecordedChannel
from ..signals.channel import on_impactor
from .build_table import Member, MissingError, member_of, table_of
from .predictors import PredictorSet, shipped
from .rows import (
    Facts,
    Levels,
    Row,
    case_of,
    facts_of_campaigns,
    force_hashes,
    levels_of,
    materials_of,
    rows_of_campaigns,
)
from .sources import (
    FACTOR,
    STATED_PLATE_MASS,
    VELOCITY,
    ImpactSource,
    Materials,
    read_number,
    read_word,
)
from .table import POINTS, PulseTable
from .velocities import CHOICES, converted, definition_of, one_kind

_PLATE_MATERIAL = "plate_material in runs.csv, or material in [bench.plate]"
_PLATE_SIZE = "material, thickness_m and outline_m in [bench.plate]"
_MATERIAL = "the material with pyroshock materials add"


@dataclass(frozen=True)
class MissingFacts:
    """`impacts` impacts lack the values of `predictors`; each of `remedies` says what is to be
    written where."""

    impacts: int
    predictors: tuple[str, ...]
    remedies: tuple[str, ...]


def missing_in_campaigns(
    session: Session, campaigns: Sequence[str], predictors: PredictorSet
) -> list[MissingFacts]:
    """What the impacts of campaigns lack that have a pulse in use.

    Parameters:
        session: A session of the store.
        campaigns: The names of the campaigns.
        predictors: What the impacts are asked for.

    Raises:
        LookupError: For an unknown campaign.
    """
    keys = [get_campaign_id(session, name) for name in sorted(set(campaigns))]
    rows = facts_of_campaigns(session, keys)
    levels = levels_of(session, (row["configuration_id"] for row, _ in rows))
    return missing_facts(rows, levels, predictors, materials_of(session))


def missing_facts(
    rows: Iterable[tuple[Row | Facts, int]],
    levels: Mapping[int, Levels],
    predictors: PredictorSet,
    materials: Materials,
) -> list[MissingFacts]:
    """What the impacts with a pulse lack, in the predictors' order; predictors that lack the same
    thing together.

    Parameters:
        rows: Impacts with a pulse, and how many each row stands for, as `facts_of_campaigns` gives
            them.
        levels: The factors of each configuration, by its key (`levels_of`).
        predictors: What the impacts are asked for.
        materials: Properties of the store's materials by name.
    """
    counts: Counter[tuple[str, tuple[str, ...]]] = Counter()
    for row, impacts in rows:
        case = case_of(row, levels[row["configuration_id"]])
        for predictor, source in zip(predictors.predictors, predictors.sources, strict=True):
            value = (
                read_word(source, case)
                if predictor.levels
                else read_number(source, case, materials)
            )
            if value is None:
                counts[predictor.name, _remedies(source, case, row["kind"])] += impacts
    order = [predictor.name for predictor in predictors.predictors]
    together: dict[tuple[int, tuple[str, ...]], list[str]] = {}
    for (name, remedies), count in sorted(counts.items(), key=lambda item: order.index(item[0][0])):
        together.setdefault((count, remedies), []).append(name)
    return [
        MissingFacts(count, tuple(names), remedies) for (count, remedies), names in together.items()
    ]


def missing_words(missing: Sequence[MissingFacts]) -> str:
    """One sentence, "11 impacts have no plate_density; 11 no boundary_conditions: ..."; empty where
    nothing is missing.

    Parameters:
        missing: What impacts lack, from `missing_facts`.
    """
    if not missing:
        return ""
    lacking = [f"{fact.impacts} no {', '.join(fact.predictors)}" for fact in missing]
    lacking[0] = lacking[0].replace(
        " no ", f" impact{'s have' if missing[0].impacts > 1 else ' has'} no ", 1
    )
    remedies = dict.fromkeys(remedy for fact in missing for remedy in fact.remedies)
    return (
        f"{'; '.join(lacking)}: training leaves such impacts out; add {'; '.join(remedies)}; "
        "and ingest the folder again"
    )


def _remedies(source: str, case: ImpactSource, kind: str) -> tuple[str, ...]:
    if source.startswith(FACTOR):
        return (f"{column_of(source.removeprefix(FACTOR))[0]} in runs.csv",)
    if source == VELOCITY:
        return (
            "impact_velocity_m_s in runs.csv (not to impacts that are "
            "stored: give the campaign another name)",
        )
    if source == "impactor.mass":
        return ("bullet_mass_kg in runs.csv" if kind == "gun" else "mass_kg in [bench.hammer]",)
    if source == "plate.thickness":
        return ("thickness_m in [bench.plate]",)
    if source == "plate.mass":
        return (f"{STATED_PLATE_MASS} in runs.csv, or {_PLATE_SIZE}",)
    return _of_material(source.partition(".")[0], case)


def _of_material(part: str, case: ImpactSource) -> tuple[str, ...]:
    if part == "tip":
        return ("tip_material in runs.csv",) if case.tip is None else (_MATERIAL,)
    remedies = []
    if part == "target" and "anvil_material" not in case.words:
        remedies.append("anvil_material in runs.csv")
    if case.plate is None:
        remedies.append(_PLATE_MATERIAL)
    return tuple(remedies) or (_MATERIAL,)


#: A recording without one of its accelerometers; no number of its impacts comes from what is not
#: there.
MISSING_CHANNEL = "missing-channel"
#: Rule -> severities that leave an impact out.
RULES: dict[str, tuple[str, ...]] = {
    "reject": ("reject",),
    "warning": ("reject", "warning"),
    "none": (),
}


def verdicts(
    session: Session, campaigns: Sequence[int], rows: Iterable[Row], rule: str
) -> dict[int, str]:
    """Impacts that a quality rule leaves out.

    Parameters:
        session: A session of the store.
        campaigns: The keys of the campaigns.
        rows: The impacts of the campaigns, as `rows_of_campaigns` gives them.
        rule: Which findings leave an impact out, one of `RULES`.

    Returns:
        The worst finding of each such impact as "CHECK (SEVERITY)", by the impact's key.

    Raises:
        ValueError: For an unknown rule.
    """
    if rule not in RULES:
        raise ValueError(f"quality rule is {rule!r}; expected one of {', '.join(RULES)}")
    findings = _findings(session, campaigns, RULES[rule]) if RULES[rule] else []
    of_impact: dict[int, str] = {}
    of_recording: dict[tuple[int, bool], str] = {}
    for impact, recording, force, velocity, text in reversed(
        findings
    ):  # the worst is first, and stays
        if impact is not None:
            of_impact[impact] = text
        else:
            if force:
                of_recording[recording, False] = text
            if force or velocity:
                of_recording[recording, True] = text
    out = {}
    for row in rows:
        integrated = velocity_kind(row["velocity_source"]) in (INTEGRATED, TARGET_MOTION_ADDED)
        verdict = of_impact.get(row["impact_id"]) or of_recording.get(
            (row["recording_id"], integrated)
        )
        if verdict:
            out[row["impact_id"]] = verdict
    return out


_Finding = tuple[int | None, int, bool, bool, str]


def _findings(
    session: Session, campaigns: Sequence[int], severities: tuple[str, ...]
) -> list[_Finding]:
    """(impact, recording, on the force or the recording, on the impactor's accelerometer, text),
    rejects first."""
    recordings = select(Impact.recording_id).where(Impact.campaign_id.in_(campaigns))
    query = (
        select(
            QualityFinding.impact_id,
            QualityFinding.recording_id,
            QualityFinding.check,
            QualityFinding.severity,
            RecordedChannel.quantity,
            RecordedChannel.position,
        )
        .outerjoin(RecordedChannel, QualityFinding.channel_id == RecordedChannel.id)
        .where(QualityFinding.severity.in_(severities), QualityFinding.recording_id.in_(recordings))
    )
    rows = []
    for impact, recording, check, severity, quantity, position in session.execute(query):
        rides = quantity == "acceleration" and on_impactor(position)
        of_force = quantity in (None, "force") and check != MISSING_CHANNEL
        rows.append((impact, recording, of_force, rides, f"{check} ({severity})"))
    return sorted(rows, key=lambda finding: (finding[4].endswith("(warning)"), finding[4]))


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
    impacts: Collection[int] | None = None,
) -> DatasetDraft:
    """The usable pulses of campaigns.

    Parameters:
        session: A session of the store.
        campaigns: The names of the campaigns, at least one.
        predictors: What models are to learn from; None for the shipped set of the campaigns' kind.
        quality: The rule of `RULES` that leaves impacts out by their quality findings.
        extraction: The fingerprint of the extraction whose pulses are taken, or the start of it;
            None for the pulses in use.
        velocity: The kind that velocities are converted to, one of `velocities.CHOICES`; by default
            they are not converted, and must be of one kind.
        impacts: The keys of the impacts that the pulses are limited to; by default all.

    Raises:
        LookupError: For an unknown campaign, extraction or factor.
        ValueError: For campaigns that do not fit the predictors or have no usable pulse, for
            velocities of several kinds, and for an unknown rule.
    """
    names = sorted(set(campaigns))
    if not names:
        raise ValueError("no campaign is named; expected at least one")
    keys = [get_campaign_id(session, name) for name in names]
    chosen = _fitting(session, names, predictors)
    _check_factors(session, chosen)
    rows = rows_of_campaigns(session, keys, _extraction_id(session, extraction))
    if impacts is not None:
        rows = [row for row in rows if row["impact_id"] in set(impacts)]
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
        extracted = ((row, 1) for row in rows if row["pulse_id"] is not None)
        facts = missing_words(missing_facts(extracted, levels, chosen, materials))
        raise ValueError(
            f"no usable pulse in {', '.join(names)}: "
            f"{_reasons_text(left_out)}{facts and f'; {facts}'}"
        )
    entered = [member.row for member in members]
    kind = one_kind(entered) if changed is None else CHOICES.get(velocity or "")
    table = table_of(members, chosen)
    used = {
        name
        for m in members
        for name in (m.case.tip, m.case.target, m.case.plate)
        if name in materials
    }
    definition = {
        "format": FORMAT,
        "campaigns": names,
        **({} if impacts is None else {"impacts": sorted(impacts)}),
        "kind": chosen.kind,
        "predictors": chosen.as_json(),
        "targets": {"force_n": POINTS, "contact_time_s": 1},
        "quality": quality,
        "velocity": definition_of(kind, changed, [row["impact_id"] for row in entered]),
        "extractions": dict(sorted(Counter(m.row["extraction"] for m in members).items())),
        # kept, for a material may be corrected later, and a frozen dataset stays as it is
        "materials": {str(name): dict(materials[str(name)]) for name in sorted(map(str, used))},
        "pulses": len(table),
        "left_out": [
            {"reason": reason, "impacts": count} for reason, count in sorted(left_out.items())
        ],
    }
    return DatasetDraft(chosen, table, definition)


def _fitting(
    session: Session, names: Sequence[str], predictors: PredictorSet | None
) -> PredictorSet:
    """The predictors, of the kind that all the campaigns are."""
    kinds = {
        name: session.scalars(select(Campaign.kind).where(Campaign.name == name)).one()
        for name in names
    }
    if predictors is None:
        if len(set(kinds.values())) > 1:
            raise ValueError(
                f"campaigns of two kinds ({_pairs(kinds)}) "
                f"have no predictors in common: take one kind"
            )
        return shipped(next(iter(kinds.values())))
    others = {name: kind for name, kind in kinds.items() if kind != predictors.kind}
    if others:
        raise ValueError(
            f"predictors {predictors.name!r} are for campaigns of kind {predictors.kind!r}, not "
            f"{_pairs(others)}; take others: --predictors {next(iter(others.values()))}"
        )
    return predictors


def _pairs(kinds: dict[str, str]) -> str:
    return ", ".join(f"{name}: {kind}" for name, kind in kinds.items())


def _check_factors(session: Session, predictors: PredictorSet) -> None:
    """Raises `LookupError` for a factor that no campaign of the store has; the thesis's may be
    missing in this one."""
    there = set(session.scalars(select(Factor.name)))
    for predictor, source in zip(predictors.predictors, predictors.sources, strict=True):
        name = source.removeprefix(FACTOR)
        if source.startswith(FACTOR) and name not in there and name not in BY_NAME:
            existing_names = ", ".join(sorted(there))
            raise LookupError(
                f"predictor {predictor.name}: no factor "
                f"{name!r} in the store; known: {existing_names}"
            )


def _extraction_id(session: Session, fingerprint: str | None) -> int | None:
    if fingerprint is None:
        return None
    settings_rows = session.execute(
        select(ExtractionSettingsRow.id, ExtractionSettingsRow.fingerprint)
    ).all()
    matches = [key for key, text in settings_rows if fingerprint and text.startswith(fingerprint)]
    if len(matches) != 1:
        there = ", ".join(text[:12] for _, text in settings_rows) or "none yet"
        raise LookupError(
            f"{len(matches) or 'no'} extractions {fingerprint!r} in the store; there: {there}"
        )
    return matches[0]


def _entering(
    session: Session,
    rows: Sequence[Row],
    bad: dict[int, str],
    predictors: PredictorSet,
    materials: Materials,
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


def _without_twins(
    members: list[Member], force: Mapping[int, str], left_out: Counter[str]
) -> list[Member]:
    """The first of the impacts that are one contact of one record: two would stand on both sides of
    every split."""
    first: dict[tuple[str, float], Member] = {}
    for member in members:
        # A pulse has a force channel; were its record gone, the raw file's hash would do.
        record = force.get(member.row["recording_id"], member.row["recording_sha256"])
        if first.setdefault((record, member.row["start_s"]), member) is not member:
            left_out["the same contact of the same record as another impact"] += 1
    return list(first.values())


def _reasons_text(left_out: Counter[str]) -> str:
    """The reasons, the most frequent first."""
    if not left_out:
        return "the campaign has no impacts (shots alone carry no force)"
    reasons = [f"{count} with {reason}" for reason, count in left_out.most_common(_REASONS_TOLD)]
    return "; ".join(reasons)
