"""Effects that a diagnosis has found become part of the twin: kept as versions, taken up by
predictions."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

import numpy as np
from sqlalchemy import func, select

from ...diagnosis.parameter_limits import exceeded_limits
from ...diagnosis.verdict import NONE, Verdict, WeightedEffects
from ...schema.campaigns import Campaign
from ...schema.diagnoses import TwinVersion
from ...schema.listings import get_campaign_id
from ...schema.transactions import take_advisory_lock
from ...twin.effects import Effect, catalogue, effect_from_json
from ..common.number_format import join_words, number

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

    from ...schema.session import Store
    from ...training.registry.records import Version

STAGES = ("gun", "contact", "plate")


#: Effects of the gun that may stand for each other, with their weights.
GunChoices = tuple[tuple[float, tuple[Effect, ...]], ...]


@dataclass(frozen=True)
class UnseenGap:
    """The model error of the diagnosed campaign on configurations that the fit had not seen,
    without and with what was adopted, in the unit of `tolerance`."""

    before: float
    after: float
    tolerance: float

    @property
    def sentence(self) -> str:
        before, after = (number(size / self.tolerance) for size in (self.before, self.after))
        return (
            f"On configurations that the fit had not seen, the model error was {before} times the "
            f"tolerance without and {after} times with what was adopted."
        )


@dataclass(frozen=True)
class AdoptedEffects:
    """One version as predictions see it: the effects that it still decides, and what to tell of
    them. Of the gun the mean prediction of `gun_choices` counts where there are any; `effects` then
    has those of the likeliest."""

    version: int
    effects: tuple[Effect, ...]
    campaign: str
    adopted_at: datetime
    gun_choices: GunChoices = ()
    error: UnseenGap | None = None

    @property
    def note(self) -> str:
        when = f"{self.adopted_at:%Y-%m-%d}"
        adopted = f"adopted {when}, version {self.version}, diagnosis of {self.campaign}"
        return (
            f"with {_names(self.effects, self.gun_choices)} ({adopted}). "
            f"{self._error_sentence.rstrip('.')}"
        )

    @property
    def sentence(self) -> str:
        """What is adopted, and how near it came to what was measured."""
        names = _names(self.effects, self.gun_choices)
        return (
            f"Version {self.version}, from the diagnosis of {self.campaign}, has "
            f"{names}. {self._error_sentence}"
        )

    @property
    def _error_sentence(self) -> str:
        if self.error is not None:
            return self.error.sentence
        return (
            "The diagnosis did not measure the model error with these effects on configurations "
            "that the fit had not seen."
        )


def _names(effects: Sequence[Effect], gun_choices: GunChoices) -> str:
    """Ids; those that are averaged as "the mean of a and b"."""
    if not gun_choices:
        return ", ".join(effect.id for effect in effects)
    choices = [" + ".join(effect.id for effect in own) for _, own in gun_choices]
    others = [
        effect.id for effect in effects if acts_at(effect.id) != "gun" or effect.stage() != "gun"
    ]
    return ", ".join([f"the mean of {join_words(choices)}", *others])


@dataclass(frozen=True)
class Adoption:
    """What can become part of the twin, by the name that `--adopt` takes: effects as they were
    fitted; those of the likeliest choice where `choices` are averaged.

    `probability` is None where the verdict has none, `after` the gap that is left held out (None:
    not measured), and `reason` says why it is this one of several that cannot be told apart.
    """

    name: str
    effects: tuple[Effect, ...]
    probability: float | None
    choices: tuple[WeightedEffects, ...] = ()
    after: float | None = None
    reason: str = ""

    @property
    def is_averaged(self) -> bool:
        return len(self.choices) > 1

    @property
    def gun_choices(self) -> GunChoices:
        """Of the gun, what is averaged."""
        if not self.is_averaged:
            return ()
        return tuple(
            (own.weight, tuple(e for e in own.effects if e.stage() == "gun"))
            for own in self.choices
        )


def offered(verdict: Verdict) -> Adoption | None:
    """What a diagnosis offers to adopt; None where no fit has parameters that the parts can have.

    Of sets whose effects cannot be told apart that is the mean of what they predict, where they are
    all of the gun; otherwise the effects that predict best on configurations that the fit has not
    seen.
    """
    averaged = verdict.averaged
    if averaged is None:
        name = verdict.first.effects[0]
        effects = None if verdict.sets else adoptable(verdict).get(_members(name))
        return (
            Adoption(name, effects, _probability(verdict, name), after=_after(verdict, name))
            if effects
            else None
        )
    choices, single = averaged.choices, averaged.choices[0]
    others = [frozenset(e.id for e in own.effects if e.stage() != "gun") for own in choices]
    if len(choices) > 1 and len(set(others)) == 1:
        probability = min((own.inclusion for own in verdict.sets), default=None)
        return Adoption(
            _averaged_name(verdict), single.effects, probability, choices, averaged.after
        )
    reason = "whose parameters are values that it can have"
    if len(choices) > 1:
        single = min(choices, key=lambda own: np.inf if own.after is None else own.after)
        reason = "which predicts best on configurations that the fit has not seen"
    name = "+".join(effect.id for effect in single.effects)
    return Adoption(
        name, single.effects, _probability(verdict, name), after=single.after, reason=reason
    )


def _averaged_name(verdict: Verdict) -> str:
    """ "gun.barrel_loss/gun.valve_flow+gun.blow_by": of each set the effects that are averaged."""
    averaged = verdict.averaged.choices if verdict.averaged else ()
    acting = {effect.id for own in averaged for effect in own.effects}
    sets = [[name for name in own.effects if name in acting] for own in verdict.sets]
    return "+".join("/".join(names) for names in sets if names)


def adoption(verdict: Verdict, wanted: str) -> Adoption:
    """What `wanted` means in a verdict, as `fitted`; or the mean that `offered` gives, by its name.

    Raises as `fitted`, and `ValueError` where a parameter is no value that its part can have.
    """
    best = offered(verdict)
    if best is not None and _sets_of(best.name) == _sets_of(wanted):
        return best
    effects, probability = fitted(verdict, wanted)
    for exceeded in exceeded_limits(effects):
        item = exceeded.parameter
        raise ValueError(
            f"{exceeded.effect} is not adopted: {item.name} = "
            f"{f'{exceeded.value:.3g} {item.unit}'.rstrip()} lies "
            f"{'beyond' if exceeded.is_beyond else 'at the end of'} its range "
            f"({exceeded.limit:g}); this is a miss of the law and not a value"
        )
    return Adoption(wanted, effects, probability, after=_after(verdict, wanted))


def _sets_of(name: str) -> frozenset[frozenset[str]]:
    parts = (part for part in name.replace(",", "+").split("+"))
    return frozenset(frozenset(word.strip() for word in part.split("/")) for part in parts)


def _after(verdict: Verdict, wanted: str) -> float | None:
    """The gap that is left held out with these effects; None where it was not measured."""
    ids = _members(wanted)
    for own in verdict.averaged.choices if verdict.averaged else ():
        if _ids(own.effects) == ids:
            return own.after
    steps = zip(_path_prefixes(verdict), verdict.path, strict=False)
    return next((step.after for prefix, step in steps if prefix == ids), None)


def acts_at(identity: str) -> str:
    """The stage whose measured exit an effect changes; a sensor's is that of the quantity that it
    reads."""
    from ...twin.sensors.effect import SensorEffect

    kind = catalogue()[identity]
    if not issubclass(kind, SensorEffect):
        return kind.stage()
    if kind.measured_force_n is not SensorEffect.measured_force_n:
        return "contact"
    return (
        "plate"
        if kind.measured_acceleration_m_s2 is not SensorEffect.measured_acceleration_m_s2
        else "gun"
    )


def fitted(verdict: Verdict, wanted: str) -> tuple[tuple[Effect, ...], float | None]:
    """The effects that go by `wanted` in a verdict, and their probability, None where the verdict
    has none for them.

    `wanted` is a fitted set ("a+b+c" or "a,b,c", in any order), an effect of a fitted set ("a"),
    the first steps of the path, or "none". Numbers are those of the set's own fit; an effect and
    first steps without one take those of the smallest fitted set that holds them. Raises
    `LookupError` naming what the diagnosis can give.
    """
    if wanted == NONE:
        return (), _probability(verdict, wanted)
    effects = adoptable(verdict).get(_members(wanted))
    if not effects:
        wanted_list, *names = (
            name.replace("+", ",") for name in (wanted, *adoptable_names(verdict), NONE)
        )
        listed = "; ".join(names)
        raise LookupError(
            f"the diagnosis of {verdict.campaign} has no fit of {wanted_list!r}; it has: {listed}"
        )
    return effects, _probability(verdict, wanted)


def check_adoptable(verdict: Verdict, wanted: str) -> None:
    """Raises as `adoption`: before anything is stored."""
    adoption(verdict, wanted)


def adoptable(verdict: Verdict) -> dict[frozenset[str], tuple[Effect, ...]]:
    """What can be adopted, by the ids of its effects: causes first, then other fits, single
    effects, the path."""
    fits = {_members(name): effects for name, effects in verdict.fits.items() if effects}
    causes = {_ids(cause.fitted): cause.fitted for cause in verdict.causes if cause.fitted}
    listed = [_members(name) for cause in verdict.causes for name in cause.effects]
    sets = (
        {ids: fits.get(ids) or causes[ids] for ids in listed if ids in fits or ids in causes}
        | causes
        | fits
    )
    for ids in [
        frozenset({effect.id}) for effects in [*sets.values()] for effect in effects
    ] + _path_prefixes(verdict):
        holders = sorted((effects for effects in sets.values() if ids <= _ids(effects)), key=len)
        if ids not in sets and holders:
            sets[ids] = tuple(effect for effect in holders[0] if effect.id in ids)
    return sets


def adoptable_names(verdict: Verdict) -> list[str]:
    """What can be adopted, as reports write it: what is offered first, then "a+b" in the order of
    the fit. Fits with parameters that are no values of their parts are left out."""
    best = offered(verdict)
    names = [
        "+".join(effect.id for effect in own)
        for own in adoptable(verdict).values()
        if not exceeded_limits(own)
    ]
    return list(dict.fromkeys([*([best.name] if best else []), *names]))


def _members(name: str) -> frozenset[str]:
    return frozenset(part.strip() for part in name.replace(",", "+").split("+"))


def _ids(effects: Sequence[Effect]) -> frozenset[str]:
    return frozenset(effect.id for effect in effects)


def _path_prefixes(verdict: Verdict) -> list[frozenset[str]]:
    """The first steps of the path, as long as each adds one effect."""
    steps = itertools.takewhile(lambda step: len(step.effects) == 1, verdict.path)
    added = [step.added for step in steps]
    return [frozenset(added[:count]) for count in range(1, len(added) + 1)]


def _probability(verdict: Verdict, wanted: str) -> float | None:
    """Of the entry of the causes that has it; else the probability that a single effect acts at
    all."""
    for cause in verdict.causes:
        for place, name in enumerate(cause.effects):
            if _members(name) == _members(wanted):
                return cause.probability * (cause.split[place] if len(cause.split) > place else 1.0)
    return next((effect.inclusion for effect in verdict.effects if effect.effect == wanted), None)


def adopt(store: Store, verdict: Verdict, wanted: str, diagnosis: int | None = None) -> TwinVersion:
    """Store `wanted` of a verdict as the newest version for the parts of its campaign's bench.

    It decides every stage that the diagnosis looked at: what an earlier one left there no longer
    counts, since both explain the same gap. `wanted` "none" goes back to the nominal stages. Raises
    as `adoption`, and `LookupError` for a campaign that is not in the store.
    """
    chosen = adoption(verdict, wanted)
    where = f"diagnosis of {verdict.campaign}"
    reason = f"{where}: {wanted}" + (
        "" if chosen.probability is None else f", probability {chosen.probability:.2f}"
    )
    configuration = configuration_json(chosen.effects, _stages_of(verdict, chosen.effects), where)
    if chosen.is_averaged:
        choices = chosen.gun_choices
        configuration["gun_choices"] = [
            {"weight": weight, "effects": [effect.as_json() for effect in own]}
            for weight, own in choices
        ]
    if chosen.after is not None:
        error = UnseenGap(verdict.gap.before, chosen.after, verdict.gap.tolerance)
        configuration["error"] = asdict(error)
    return store.write(
        lambda session: _add(session, verdict.campaign, configuration, reason, diagnosis)
    )


def _add(
    session: Session,
    campaign: str,
    configuration: dict[str, Any],
    reason: str,
    diagnosis: int | None,
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


def configuration_json(
    effects: Sequence[Effect], stages: Sequence[str], where: str
) -> dict[str, Any]:
    """Effects with the source of each number, as the store keeps them; and what they decide."""
    source = {"kind": "fitted", "where": where}
    numbers = [f"{effect.id}.{item.name}" for effect in effects for item in effect.parameters()]
    return {
        "stages": list(stages),
        "effects": [effect.as_json() for effect in effects],
        "sources": dict.fromkeys(numbers, source),
    }


def _stages_of(verdict: Verdict, effects: Sequence[Effect]) -> list[str]:
    """`simulator` names them: "gun:adiabatic | contact:hertz"; a registered model stands for the
    contact."""
    named = {part.split(":")[0].strip() for part in verdict.simulator.split("|")}
    named = {"contact" if stage == "models" else stage for stage in named} | {
        acts_at(effect.id) for effect in effects
    }
    return [stage for stage in STAGES if stage in named]


def effects_of_stages(verdict: Verdict) -> list[str]:
    """Ids of the catalogue's effects that act in the stages which a diagnosis simulated."""
    stages = _stages_of(verdict, ())
    return [identity for identity in catalogue() if acts_at(identity) in stages]


def adopted_for(session: Session, campaign: str) -> list[AdoptedEffects]:
    """For each stage, what the newest version says whose campaign had the same gun, hammer or plate
    there.

    Versions with effects only, the newest first. Raises `LookupError` for an unknown campaign.
    """
    bench = session.get_one(Campaign, get_campaign_id(session, campaign))
    open_stages, adopted = set(STAGES), []
    for row in session.scalars(select(TwinVersion).order_by(TwinVersion.version.desc())):
        decided = {stage for stage in _decides(row, bench) if stage in open_stages}
        open_stages -= decided
        effects = tuple(effect for effect in _effects(row) if acts_at(effect.id) in decided)
        if effects:
            choices = _gun_choices(row) if "gun" in decided else ()
            stored = row.configuration.get("error")
            error = UnseenGap(**stored) if stored else None
            adopted.append(
                AdoptedEffects(
                    row.version, effects, row.campaign.name, row.adopted_at, choices, error
                )
            )
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


def learned_by(
    session: Session | None, version: Version, adopted: Sequence[Effect]
) -> tuple[Effect, ...]:
    """Of adopted effects of the contact, those that a model's measured pulses hold already: all
    where it learned from campaigns with the same gun or hammer as a diagnosed one, or where nobody
    knows any more what it learned from."""
    from .learning import training_campaigns

    names = training_campaigns(session, version)
    if session is None or not names:
        return tuple(adopted)
    taught = [session.get_one(Campaign, get_campaign_id(session, name)) for name in names]
    held = {
        effect.id
        for row in session.scalars(select(TwinVersion))
        for effect in _effects(row)
        if any(
            row.campaign_id == campaign.id or _same_part("contact", row.campaign, campaign)
            for campaign in taught
        )
    }
    return tuple(effect for effect in adopted if effect.id in held)


def _effects(row: TwinVersion) -> tuple[Effect, ...]:
    return tuple(effect_from_json(table) for table in row.configuration["effects"])


def _gun_choices(row: TwinVersion) -> GunChoices:
    return tuple(
        (own["weight"], tuple(map(effect_from_json, own["effects"])))
        for own in row.configuration.get("gun_choices", ())
    )


def configuration_name(configuration: Mapping[str, Any]) -> str:
    """The effects of a stored version: "gun.valve_flow + contact.plastic_yield", "the mean of a and
    b"; "none"."""
    effects = tuple(map(effect_from_json, configuration["effects"]))
    choices = tuple(
        (own["weight"], tuple(map(effect_from_json, own["effects"])))
        for own in configuration.get("gun_choices", ())
    )
    return (
        _names(effects, choices) if choices else " + ".join(effect.id for effect in effects)
    ) or NONE


def effects_in_use(
    session: Session, campaign: str, given: Sequence[Effect] = (), without: Sequence[str] = ()
) -> tuple[tuple[Effect, ...], tuple[str, ...]]:
    """Adopted effects that a prediction of a campaign's bench uses, and notes that say so.

    One that is `given` by hand goes before the adopted one of the same id; stages `without` keep
    their nominal law.
    """
    by_hand = {effect.id for effect in given}
    effects: list[Effect] = []
    notes = []
    for adopted in adopted_for(session, campaign):
        own = tuple(
            e for e in adopted.effects if e.id not in by_hand and acts_at(e.id) not in without
        )
        effects += own
        if own:
            notes.append(
                replace(adopted, effects=own, gun_choices=_kept(adopted.gun_choices, own)).note
            )
    return tuple(effects), tuple(notes)


def gun_choices_in_use(
    session: Session, campaign: str, given: Sequence[Effect] = (), without: Sequence[str] = ()
) -> GunChoices:
    """Effects of the gun that were adopted as a mean; () where one fit was adopted, where an effect
    of the gun is `given` by hand, and where the gun keeps its nominal law."""
    if "gun" in without or any(effect.stage() == "gun" for effect in given):
        return ()
    return next(
        (adopted.gun_choices for adopted in adopted_for(session, campaign) if adopted.gun_choices),
        (),
    )


def _kept(choices: GunChoices, effects: Sequence[Effect]) -> GunChoices:
    """Choices as long as the effects of the likeliest one act."""
    likeliest = {effect.id for effect in choices[0][1]} if choices else set()
    return choices if likeliest <= {effect.id for effect in effects} else ()
