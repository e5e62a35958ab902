"""Effects that a diagnosis has found become part of the twin: kept as versions, taken up by predictions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from sqlalchemy import func, select

from ...diagnosis.verdict import NONE, UNKNOWN, Cause, Verdict
from ...schema.campaigns import Campaign
from ...schema.listings import get_campaign_id
from ...schema.turns import take_turn
from ...schema.twins import TwinVersion
from ...twin.configuration import Source
from ...twin.effects import Effect, catalogue, effect_from_json

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

    from ...schema.session import Store

STAGES = ("gun", "contact", "plate")


@dataclass(frozen=True)
class Adopted:
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


def fitted(verdict: Verdict, wanted: str) -> tuple[tuple[Effect, ...], float]:
    """Effects that go by `wanted` ("gun.valve_flow", "a+b", "none") in a verdict, and its probability.

    Raises `LookupError` naming what the diagnosis can give.
    """
    cause = _cause_with(verdict, wanted)
    probability = 0.0 if cause is None else _share(cause, wanted)
    if wanted == NONE:
        return (), probability
    found = verdict.fits.get(wanted) or _of_cause(cause, wanted)
    if not found:
        known = ", ".join(_adoptable(verdict)) or "nothing"
        raise LookupError(f"the diagnosis of {verdict.campaign} has no fit of {wanted!r}; it has: {known}, and none")
    return found, probability


def _cause_with(verdict: Verdict, wanted: str) -> Cause | None:
    return next((cause for cause in verdict.causes if wanted in cause.effects), None)


def _share(cause: Cause, wanted: str) -> float:
    place = cause.effects.index(wanted)
    return cause.probability * (cause.split[place] if len(cause.split) > place else 1.0)


def _of_cause(cause: Cause | None, wanted: str) -> tuple[Effect, ...]:
    """`fitted` is of the likeliest member alone."""
    if cause is None or sorted(effect.id for effect in cause.fitted) != sorted(wanted.split("+")):
        return ()
    return cause.fitted


def _adoptable(verdict: Verdict) -> list[str]:
    own = [each for cause in verdict.causes for each in cause.effects if each not in (NONE, UNKNOWN)]
    return [each for each in dict.fromkeys((*own, *verdict.fits)) if verdict.fits.get(each) or _fit_of(verdict, each)]


def _fit_of(verdict: Verdict, wanted: str) -> tuple[Effect, ...]:
    return _of_cause(_cause_with(verdict, wanted), wanted)


def adopt(store: Store, verdict: Verdict, wanted: str, diagnosis: int | None = None) -> TwinVersion:
    """Store `wanted` of a verdict as the newest version for the parts of its campaign's bench.

    It decides every stage that the diagnosis looked at: what an earlier one left there no longer counts, since both
    explain the same gap. `wanted` "none" goes back to the nominal stages. Raises as `fitted`, and `LookupError` for a
    campaign that is not in the store.
    """
    effects, probability = fitted(verdict, wanted)
    where = f"diagnosis of {verdict.campaign}"
    reason = f"{where}: {wanted}, probability {probability:.2f}"
    decided = _stages_of(verdict, effects)
    configuration = configuration_json(effects, decided, where)
    return store.write(lambda session: _add(session, verdict.campaign, configuration, reason, diagnosis))


def _add(
    session: Session, campaign: str, configuration: dict[str, Any], reason: str, diagnosis: int | None
) -> TwinVersion:
    take_turn(session, "the twin's next version")
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
    """Effects with the source of each number, under the keys of `TwinConfiguration.as_json`; and what they decide."""
    source = asdict(Source("fitted", where))
    numbers = [f"{effect.id}.{item.name}" for effect in effects for item in effect.parameters()]
    return {
        "stages": list(stages),
        "effects": [effect.as_json() for effect in effects],
        "sources": dict.fromkeys(numbers, source),
    }


def _stages_of(verdict: Verdict, effects: Sequence[Effect]) -> list[str]:
    """`simulator` names them: "gun:adiabatic | contact:hertz"; a registered model stands for the contact."""
    named = {part.split(":")[0].strip() for part in verdict.simulator.split("|")}
    named = {"contact" if each == "models" else each for each in named} | {acts_at(effect.id) for effect in effects}
    return [stage for stage in STAGES if stage in named]


def adopted_for(session: Session, campaign: str) -> list[Adopted]:
    """For each stage, what the newest version says whose campaign had the same gun, hammer or plate there.

    Versions with effects only, the newest first. Raises `LookupError` for an unknown campaign.
    """
    bench = session.get_one(Campaign, get_campaign_id(session, campaign))
    open_stages, found = set(STAGES), []
    for row in session.scalars(select(TwinVersion).order_by(TwinVersion.version.desc())):
        decided = {stage for stage in _decides(row, bench) if stage in open_stages}
        open_stages -= decided
        effects = tuple(effect for effect in _effects(row) if acts_at(effect.id) in decided)
        if effects:
            found.append(Adopted(row.version, effects, row.campaign.name, row.adopted_at))
    return found


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


def _effects(row: TwinVersion) -> tuple[Effect, ...]:
    return tuple(effect_from_json(table) for table in row.configuration["effects"])


def taken_up(
    session: Session, campaign: str, given: Sequence[Effect] = (), without: Sequence[str] = ()
) -> tuple[tuple[Effect, ...], tuple[str, ...]]:
    """Adopted effects that a prediction of a campaign's bench uses, and notes that say so.

    One that is `given` by hand goes before the adopted one of the same id; stages `without` keep their nominal law.
    """
    by_hand = {effect.id for effect in given}
    effects: list[Effect] = []
    notes = []
    for each in adopted_for(session, campaign):
        own = tuple(e for e in each.effects if e.id not in by_hand and acts_at(e.id) not in without)
        effects += own
        if own:
            notes.append(Adopted(each.version, own, each.campaign, each.adopted_at).note)
    return tuple(effects), tuple(notes)
