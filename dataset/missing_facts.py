"""Facts that predictors ask for and impacts lack: how many lack which, and where each is written down."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from sqlalchemy.orm import Session

from ..schema.known_factors import column_of
from ..schema.listings import get_campaign_id
from .predictors import PredictorSet
from .rows import Levels, Row, case_of, levels_of, materials_of, rows_of_campaigns
from .sources import FACTOR, STATED_PLATE_MASS, VELOCITY, ImpactSource, Materials, read_number, read_word

_PLATE_MATERIAL = "plate_material in runs.csv, or material in [bench.plate]"
_PLATE_SIZE = "material, thickness_m and outline_m in [bench.plate]"
_MATERIAL = "the material with pyroshock materials add"


@dataclass(frozen=True)
class MissingFacts:
    """`impacts` impacts lack the values of `predictors`; each of `remedies` says what is to be written where."""

    impacts: int
    predictors: tuple[str, ...]
    remedies: tuple[str, ...]


def missing_in_campaigns(session: Session, campaigns: Sequence[str], predictors: PredictorSet) -> list[MissingFacts]:
    """What the impacts of `campaigns` lack that have a pulse in use. Raises `LookupError` for an unknown campaign."""
    rows = rows_of_campaigns(session, [get_campaign_id(session, name) for name in sorted(set(campaigns))], None)
    levels = levels_of(session, (row["configuration_id"] for row in rows))
    return missing_facts(rows, levels, predictors, materials_of(session))


def missing_facts(
    rows: Iterable[Row], levels: Mapping[int, Levels], predictors: PredictorSet, materials: Materials
) -> list[MissingFacts]:
    """What the impacts with a pulse lack, in the predictors' order; predictors that lack the same thing together."""
    counts: Counter[tuple[str, tuple[str, ...]]] = Counter()
    for row in rows:
        if row["pulse_id"] is None:
            continue
        case = case_of(row, levels[row["configuration_id"]])
        for predictor, source in zip(predictors.predictors, predictors.sources, strict=True):
            value = read_word(source, case) if predictor.levels else read_number(source, case, materials)
            if value is None:
                counts[predictor.name, _remedies(source, case, row["kind"])] += 1
    order = [predictor.name for predictor in predictors.predictors]
    together: dict[tuple[int, tuple[str, ...]], list[str]] = {}
    for (name, remedies), count in sorted(counts.items(), key=lambda item: order.index(item[0][0])):
        together.setdefault((count, remedies), []).append(name)
    return [MissingFacts(count, tuple(names), remedies) for (count, remedies), names in together.items()]


def missing_words(missing: Sequence[MissingFacts]) -> str:
    """One sentence, "11 impacts have no plate_density; 11 no boundary_conditions: ..."; empty where nothing is."""
    if not missing:
        return ""
    lacking = [f"{fact.impacts} no {', '.join(fact.predictors)}" for fact in missing]
    lacking[0] = lacking[0].replace(" no ", f" impact{'s have' if missing[0].impacts > 1 else ' has'} no ", 1)
    remedies = dict.fromkeys(remedy for fact in missing for remedy in fact.remedies)
    return (
        f"{'; '.join(lacking)}: training leaves such impacts out; add {'; '.join(remedies)}; "
        "and ingest the folder again"
    )


def _remedies(source: str, case: ImpactSource, kind: str) -> tuple[str, ...]:
    if source.startswith(FACTOR):
        return (f"{column_of(source.removeprefix(FACTOR))[0]} in runs.csv",)
    if source == VELOCITY:
        return ("impact_velocity_m_s in runs.csv (not to impacts that are stored: give the campaign another name)",)
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
