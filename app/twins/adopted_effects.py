"""Effects that a diagnosis has found become part of the twin: kept as versions, taken up by predictions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from sqlalchemy import func, select

from ...diagnosis.verdict import NONE, Verdict
from ...schema.campaigns import Campaign
from ...schema.diagnoses import TwinVersion
from ...schema.listings import get_campaign_id
from ...schema.transactions import take_advisory_lock
from ...twin.effects import Effect, catalogue, effect_from_json

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

    from ...schema.session import Store
    from ...training.registry.records import Version

STAGES = ("gun", "contact", "plate")


@dataclass(frozen=True)
class AdoptedEffects:
    """One version as predictions see it: the effects that it still decides, and what to tell of them."""

    version: int
    effects: tuple[Effect, ...]
    campaign: str
    adopted_at: datetime

    @property
    def note(self) -> str:
        names = ", ".join(effect.id for effect in self.effects)
        when = f"{self.adopted_at:%Y-%m-%d}"
        return f"with {names} (adopted {when}, version {self.version}, diagnosis of {self.campaign})"


def acts_at(identity: str) -> str:
    """The stage whose measured exit an effect changes; a sensor's is that of the quantity that it reads."""
    from ...twin.sensors.effect import SensorEffect

    kind = catalogue()[identity]
    if not issubclass(kind, SensorEffect):
        return kind.stage()
    if kind.measured_force_n is not SensorEffect.measured_force_n:
        return "contact"
    return "plate" if kind.measured_acceleration_m_s2 is not SensorEffect.measured_acceleration_m_s2 else "gun"


def fitted(verdict: Verdict, wanted: str) -> tuple[tuple[Effect, ...], float | None]:
    """The effects that go by `wanted` in a verdict, and their probability, None where the verdict has none for them.

    `wanted` is a fitted set ("a+b+c" or "a,b,c", in any order), an effect of a fitted set ("a"), the first steps of the
    path, or "none". Numbers are those of the set's own fit; an effect and first steps without one take those of the
    smallest fitted set that holds them. Raises `LookupError` naming what the diagnosis can give.
    """
    if wanted == NONE:
        return (), _probability(verdict, wanted)
    effects = adoptable(verdict).get(_members(wanted))
    if not effects:
        wanted_list, *names = (name.replace("+", ",") for name in (wanted, *adoptable_names(verdict), NONE))
        listed = "; ".join(names)
        raise LookupError(f"the diagnosis of {verdict.campaign} has no fit of {wanted_list!r}; it has: {listed}")
    return effects, _probability(verdict, wanted)


def check_adoptable(verdict: Verdict, wanted: str) -> None:
    """Raises `LookupError` where a verdict has no fit of `wanted`, as `fitted` does: before anything is stored."""
    fitted(verdict, wanted)


def adoptable(verdict: Verdict) -> dict[frozenset[str], tuple[Effect, ...]]:
    """What can be adopted, by the ids of its effects: causes first, then other fits, single effects, the path."""
    fits = {_members(name): effects for name, effects in verdict.fits.items() if effects}
    causes = {_ids(cause.fitted): cause.fitted for cause in verdict.causes if cause.fitted}
    listed = [_members(name) for cause in verdict.causes for name in cause.effects]
    sets = {ids: fits.get(ids) or causes[ids] for ids in listed if ids in fits or ids in causes} | causes | fits
    for ids in [frozenset({effect.id}) for effects in [*sets.values()] for effect in effects] + _path_prefixes(verdict):
        holders = sorted((effects for effects in sets.values() if ids <= _ids(effects)), key=len)
        if ids not in sets and holders:
            sets[ids] = tuple(effect for effect in holders[0] if effect.id in ids)
    return sets


def adoptable_names(verdict: Verdict) -> list[str]:
    """The keys of `adoptable` as reports write them: "a+b", in the order of the fit."""
    return ["+".join(effect.id for effect in effects) for effects in adoptable(verdict).values()]


def _members(name: str) -> frozenset[str]:
    return frozenset(part.strip() for part in name.replace(",", "+").split("+"))


def _ids(effects: Sequence[Effect]) -> frozenset[str]:
    return frozenset(effect.id for effect in effects)


def _path_prefixes(verdict: Verdict) -> list[frozenset[str]]:
    added = [step.added for step in verdict.path]
    return [frozenset(added[:count]) for count in range(1, len(added) + 1)]


def _probability(verdict: Verdict, wanted: str) -> float | None:
    """Of the entry of the causes that has it; else the probability that a single effect acts at all."""
    for cause in verdict.causes:
        for place, name in enumerate(cause.effects):
            if _members(name) == _members(wanted):
                return cause.probability * (cause.split[place] if len(cause.split) > place else 1.0)
    return next((effect.inclusion for effect in verdict.effects if effect.effect == wanted), None)


def adopt(store: Store, verdict: Verdict, wanted: str, diagnosis: int | None = None) -> TwinVersion:
    """Store `wanted` of a verdict as the newest version for the parts of its campaign's bench.

    It decides every stage that the diagnosis looked at: what an earlier one left there no longer counts, since both
    explain the same gap. `wanted` "none" goes back to the nominal stages. Raises as `fitted`, and `LookupError` for a
    campaign that is not in the store.
    """
    effects, probability = fitted(verdict, wanted)
    where = f"diagnosis of {verdict.campaign}"
    reason = f"{where}: {wanted}" + ("" if probability is None else f", probability {probability:.2f}")
    decided = _stages_of(verdict, effects)
    configuration = configuration_json(effects, decided, where)
    return store.write(lambda session: _add(session, verdict.campaign, configuration, reason, diagnosis))


def _add(
    session: Session, campaign: str, configuration: dict[str, Any], reason: str, diagnosis: int | None
) -> TwinVersion:
    take_advisory_lock(session, "the twin's next version")
    newest = session.scalar(select(func.max(TwinVersion.version))) or 0
    row = TwinVersion(
        version=newest + 1,
        campaign_id=get_campaign_id(session, campaign),
        diagnosis_id=diagnosis,
        adopted_at=datetime.now(UTC),
        reason=reason,
        configuration=configuration,
    )
    session.add(row)
    session.flush()
    session.expunge(row)
    return row


def configuration_json(effects: Sequence[Effect], stages: Sequence[str], where: str) -> dict[str, Any]:
    """Effects with the source of each number, as the store keeps them; and what they decide."""
    source = {"kind": "fitted", "where": where}
    numbers = [f"{effect.id}.{item.name}" for effect in effects for item in effect.parameters()]
    return {
        "stages": list(stages),
        "effects": [effect.as_json() for effect in effects],
        "sources": dict.fromkeys(numbers, source),
    }


def _stages_of(verdict: Verdict, effects: Sequence[Effect]) -> list[str]:
    """`simulator` names them: "gun:adiabatic | contact:hertz"; a registered model stands for the contact."""
    named = {part.split(":")[0].strip() for part in verdict.simulator.split("|")}
    named = {"contact" if stage == "models" else stage for stage in named} | {acts_at(effect.id) for effect in effects}
    return [stage for stage in STAGES if stage in named]


def effects_of_stages(verdict: Verdict) -> list[str]:
    """Ids of the catalogue's effects that act in the stages which a diagnosis simulated."""
    stages = _stages_of(verdict, ())
    return [identity for identity in catalogue() if acts_at(identity) in stages]


def adopted_for(session: Session, campaign: str) -> list[AdoptedEffects]:
    """For each stage, what the newest version says whose campaign had the same gun, hammer or plate there.

    Versions with effects only, the newest first. Raises `LookupError` for an unknown campaign.
    """
    bench = session.get_one(Campaign, get_campaign_id(session, campaign))
    open_stages, adopted = set(STAGES), []
    for row in session.scalars(select(TwinVersion).order_by(TwinVersion.version.desc())):
        decided = {stage for stage in _decides(row, bench) if stage in open_stages}
        open_stages -= decided
        effects = tuple(effect for effect in _effects(row) if acts_at(effect.id) in decided)
        if effects:
            adopted.append(AdoptedEffects(row.version, effects, row.campaign.name, row.adopted_at))
    return adopted


def _decides(row: TwinVersion, bench: Campaign) -> Iterator[str]:
    for stage in row.configuration["stages"]:
        if row.campaign_id == bench.id or _same_part(stage, row.campaign, bench):
            yield stage


def _same_part(stage: str, a: Campaign, b: Campaign) -> bool:
    if stage == "plate":
        return a.plate_id is not None and a.plate_id == b.plate_id
    if a.gun_id is not None or stage == "gun":
        return a.gun_id is not None and a.gun_id == b.gun_id
    return a.hammer_id is not None and a.hammer_id == b.hammer_id


def learned_by(session: Session | None, version: Version, adopted: Sequence[Effect]) -> tuple[Effect, ...]:
    """Of adopted effects of the contact, those that a model's measured pulses hold already: all where it learned from
    campaigns with the same gun or hammer as a diagnosed one, or where nobody knows any more what it learned from."""
    from .learning import training_campaigns

    names = training_campaigns(session, version)
    if session is None or not names:
        return tuple(adopted)
    taught = [session.get_one(Campaign, get_campaign_id(session, name)) for name in names]
    held = {
        effect.id
        for row in session.scalars(select(TwinVersion))
        for effect in _effects(row)
        if any(row.campaign_id == campaign.id or _same_part("contact", row.campaign, campaign) for campaign in taught)
    }
    return tuple(effect for effect in adopted if effect.id in held)


def _effects(row: TwinVersion) -> tuple[Effect, ...]:
    return tuple(effect_from_json(table) for table in row.configuration["effects"])


def effects_in_use(
    session: Session, campaign: str, given: Sequence[Effect] = (), without: Sequence[str] = ()
) -> tuple[tuple[Effect, ...], tuple[str, ...]]:
    """Adopted effects that a prediction of a campaign's bench uses, and notes that say so.

    One that is `given` by hand goes before the adopted one of the same id; stages `without` keep their nominal law.
    """
    by_hand = {effect.id for effect in given}
    effects: list[Effect] = []
    notes = []
    for adopted in adopted_for(session, campaign):
        own = tuple(e for e in adopted.effects if e.id not in by_hand and acts_at(e.id) not in without)
        effects += own
        if own:
            notes.append(AdoptedEffects(adopted.version, own, adopted.campaign, adopted.adopted_at).note)
    return tuple(effects), tuple(notes)
