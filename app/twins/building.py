"""A twin of what is in the store: bench, materials, the model in use, the scatter of its measured
shots."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...dataset.predictors import SHIPPED
from ...dataset.rows import by_name, material_named, stored_materials
from ...schema.impacts import BEFORE_CONTACT, INTEGRATED
from ...schema.known_factors import checked_chain_height
from ...training.registry.connection import user_environment
from ...training.registry.model_storage import storage_for
from ...twin.chain import Twin, default_lines
from ...twin.contact.prior import PriorContact
from ...twin.coupled_contact import CoupledContact
from ...twin.effects import Effect, checked_effects
from ...twin.gun.averaged import AveragedGunStage
from ...twin.gun.shot import GunEffect
from ...twin.gun.stage import GunStage
from ...twin.plate.stage import PlateSpread, PlateStage
from ...twin.sensors.chain import SensorChain
from ...twin.setting import THESIS, ElasticMaterial, Setting
from ..common.model_registry import note_of, registry_of
from .benches import (
    Bench,
    PlateDrawing,
    Point,
    bench_of_campaign,
    bench_of_file,
    shipped_bench,
    with_modes,
)
from .learning import (
    MOST_SHOTS,
    basis,
    calibrated,
    model_in_use,
    taught_contact,
    taught_gun,
    velocity_kind_of,
)
from .measured_shots import no_shots, read_measured_shots, struck_plate

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

    from ...array_types import Floats
    from ...schema.session import Store
    from ...training.registry.records import Version
    from ...training.registry.registry import Registry
    from ...twin.contact_interface import ContactStage
    from ...twin.measured_shots import MeasuredShots
    from ...twin.plate.modal import ModalPlate
    from .adopted_effects import GunChoices

#: Without a model: what is likely of the contact, narrowed by measured shots (`PriorContact`).
PRIOR = "prior"
REGISTERED = "registered"
#: A solved plate has the modes up to here, whatever lines are asked for: its peak acceleration is
#: of this band. It is twice the highest line of most specifications, and the rate of 100 kHz shows
#: no mode badly.
MAX_MODE_HZ = 20_000.0
#: Scatter (ln, standard deviation) of a gun's shots that nobody has measured: that of Table 5.1
#: about one factor.
THESIS_VELOCITY_SPREAD = 0.046


@dataclass(frozen=True)
class TwinRequest:
    """What a user asks of a twin; what is None or empty is the store's, else the shipped bench's.

    `adopted`: effects that diagnoses have left to the campaign's bench act, too. `learn`: the
    campaign's measured shots teach every stage, but for those of `without_configurations` (keys of
    the store), which the twin has then not seen. `chain_height_m`: by which the plate hangs higher
    than its drawing has it, and is struck lower; whole links of its chain, else `ValueError`.
    `coupled`: contact and plate are solved together, which takes the prior or a law that is solved
    in time (hertz).
    """

    campaign: str | None = None
    modes: Path | None = None
    bench: Path | None = None
    contact: str | None = None
    effects: tuple[Effect, ...] = ()
    impact_points: tuple[Point, ...] = ()
    sensors: tuple[Point, ...] = ()
    plate: str | None = None
    q: float = 10.0
    frequency_hz: tuple[float, ...] = ()
    adopted: bool = True
    learn: bool = True
    without_configurations: frozenset[int] = frozenset()
    chain_height_m: float = 0.0
    coupled: bool = False

    def __post_init__(self) -> None:
        checked_chain_height(self.chain_height_m)


@dataclass(frozen=True, eq=False)
class BuiltTwin:
    """A twin, and what settings for it are made of. `notes` are for the user: what was assumed."""

    twin: Twin
    bench: Bench
    plate: ElasticMaterial
    materials: Mapping[str, ElasticMaterial]
    notes: tuple[str, ...] = field(default=())

    def material(self, name: str) -> ElasticMaterial:
        """By name or alias. Raises `LookupError` naming those there are."""
        return material_named(self.materials, name)

    def setting(self, **own: Any) -> Setting:
        """A setting on this twin's plate; `own` are the other fields of `Setting`."""
        drawing = self.bench.drawing
        mass = drawing.area_m2 * drawing.thickness_m * self.plate.density_kg_m3
        fields_given = {"plate_mass_kg": mass, **own}
        return Setting(plate=self.plate, plate_thickness_m=drawing.thickness_m, **fields_given)


def twin_of(
    store: Store | None, db: str, request: TwinRequest, shots: MeasuredShots | None = None
) -> BuiltTwin:
    """The twin; without a store, of the shipped bench. Raises `LookupError`, `ValueError` for what
    there is not.

    `shots` are those of the campaign, where they were read before: reading takes longer than
    learning.
    """
    if store is None:
        if request.campaign is not None:
            raise LookupError(f"no campaign {request.campaign!r}: there is no store at {db}")
        return _built(None, shipped_bench(), by_name(THESIS.values(), {}), db, request)
    with store.reading() as session:
        bench = bench_of_campaign(session, request.campaign)
        return _built(session, bench, stored_materials(session), db, request, shots)


def _built(
    session: Session | None,
    bench: Bench,
    materials: Mapping[str, ElasticMaterial],
    db: str,
    request: TwinRequest,
    shots: MeasuredShots | None = None,
) -> BuiltTwin:
    recorded = bench
    if request.bench is not None:
        bench = bench_of_file(request.bench, bench)
    if request.modes is not None:
        bench = with_modes(bench, request.modes)
    plate = material_named(materials, request.plate or bench.plate_material)
    by_hand = request.effects
    adopted, adopted_notes = _adopted(session, bench, request)
    adopted_contact = tuple(effect for effect in adopted if effect.stage() == "contact")
    request = replace(
        request, effects=(*request.effects, *(e for e in adopted if e not in adopted_contact))
    )
    plates, plate_note = _plates(bench, plate, db, request)
    if shots is None:
        shots = _shots(session, recorded, materials, plates.sensors, request)
    shots = shots.without(sorted(request.without_configurations))
    same_gun = request.learn and bench.gun == recorded.gun
    taught_by = recorded.campaign if same_gun else None
    choices = _gun_choices(session, bench, replace(request, effects=by_hand))
    gun, gun_note = _averaged_gun(session, bench, request, taught_by, choices)
    contact, contact_note = _contact(session, db, bench, request, adopted_contact)
    contact = taught_contact(contact, shots)
    if request.coupled:
        contact = _coupled(contact, plates)
    twin = Twin(
        contact=contact,
        gun=gun,
        plate=plates,
        sensors=SensorChain.of(_of_stage(request, "sensor")),
        frequency_hz=_lines(request),
        q=request.q,
    )
    same_plate = (bench.drawing, bench.modes) == (recorded.drawing, recorded.modes)
    others = (
        None
        if bench.modes is not None
        else lambda name: _drawn_plate(bench, materials[name.lower()], db, request)
    )
    twin, spectra_note = calibrated(twin, shots if same_plate else shots.take([]), others)
    twin = replace(twin, rests_on=basis(twin, recorded.campaign))
    notes = tuple(
        note for note in (*adopted_notes, gun_note, contact_note, plate_note, spectra_note) if note
    )
    return BuiltTwin(twin, bench, plate, materials, notes)


def _lines(request: TwinRequest) -> Floats:
    return np.array(request.frequency_hz) if request.frequency_hz else default_lines()


def _shots(
    session: Session | None,
    bench: Bench,
    materials: Mapping[str, ElasticMaterial],
    sensors: tuple[str, ...],
    request: TwinRequest,
) -> MeasuredShots:
    """Of the campaign whose bench is taken; none where nothing is to be learned."""
    lines = _lines(request)
    if session is None or bench.campaign is None or not request.learn:
        return no_shots(sensors, lines, request.q)
    return read_measured_shots(
        session,
        bench.campaign,
        frequency_hz=lines,
        q=request.q,
        sensors=sensors,
        material=lambda name: material_named(materials, name),
        plate=struck_plate(bench),
        most=MOST_SHOTS,
    )[0]


def _adopted(
    session: Session | None, bench: Bench, request: TwinRequest
) -> tuple[tuple[Effect, ...], tuple[str, ...]]:
    """Of the campaign's bench; a bench or a plate given by hand is another one."""
    from .adopted_effects import effects_in_use

    if (
        session is None
        or bench.campaign is None
        or request.bench is not None
        or not request.adopted
    ):
        return (), ()
    other_plate = (
        request.modes is not None or (request.plate or bench.plate_material) != bench.plate_material
    )
    return effects_in_use(
        session, bench.campaign, request.effects, ("plate",) if other_plate else ()
    )


def _gun_choices(session: Session | None, bench: Bench, request: TwinRequest) -> GunChoices:
    """Effects of the gun that were adopted as a mean; as `_adopted` where they count."""
    from .adopted_effects import gun_choices_in_use

    if (
        session is None
        or bench.campaign is None
        or request.bench is not None
        or not request.adopted
    ):
        return ()
    return gun_choices_in_use(session, bench.campaign, request.effects)


def _of_stage(request: TwinRequest, stage: str) -> tuple[Effect, ...]:
    return tuple(effect for effect in request.effects if effect.stage() == stage)


def _gun(
    session: Session | None, bench: Bench, request: TwinRequest, campaign: str | None
) -> tuple[GunStage | None, str]:
    """The gun with its unknown effects drawn, updated by the measured shots of `campaign`.

    None on a bench without one. Raises `ValueError` for effects of a gun there.
    """
    effects = checked_effects(_of_stage(request, "gun"), GunEffect)
    if not bench.has_gun:
        if effects:
            names = ", ".join(effect.id for effect in effects)
            raise ValueError(
                f"effect {names}: campaign "
                f"{bench.campaign!r} is of kind {bench.kind!r} and has no gun"
            )
        return None, ""
    stage = GunStage(
        bench.gun, THESIS_VELOCITY_SPREAD, effects, bench.gun_source, unknown_effects=True
    )
    twice = bench.gun.efficiency < 1 and bool(effects)
    also = (
        f"; the bench's efficiency {bench.gun.efficiency:g} acts beside the gun's effects"
        if twice
        else ""
    )
    left_out = ""
    if session is not None and campaign is not None:
        stage, left_out = taught_gun(session, campaign, stage, request.without_configurations)
    return stage, f"{stage.sentence.rstrip('.')}{left_out}{also}"


def _averaged_gun(
    session: Session | None,
    bench: Bench,
    request: TwinRequest,
    campaign: str | None,
    choices: GunChoices,
) -> tuple[GunStage | None, str]:
    """The gun as `_gun` makes it; with `choices` the mean of a gun for each, in the place of the
    request's effects of the gun."""
    if not choices:
        return _gun(session, bench, request, campaign)
    others = tuple(effect for effect in request.effects if effect.stage() != "gun")
    guns, notes = [], []
    for weight, effects in choices:
        gun, note = _gun(session, bench, replace(request, effects=(*others, *effects)), campaign)
        if gun is None:
            return None, note
        guns.append((weight, gun))
        notes.append(note)
    return AveragedGunStage.of(guns), notes[0]


def _contact(
    session: Session | None,
    db: str,
    bench: Bench,
    request: TwinRequest,
    adopted: tuple[Effect, ...] = (),
) -> tuple[ContactStage, str]:
    """The model in use for this kind of bench, or one that is asked for; else the prior of the
    contact, or a law.

    Effects act on all of them.
    """
    from ...twin.contact.laws import LAWS

    effects = _of_stage(request, "contact")
    if (
        request.coupled and request.contact is None
    ):  # a model has learned pulses, and knows no plate to solve against
        request = replace(request, contact=PRIOR)
    if request.contact is not None and request.contact in LAWS:
        return _law(request.contact, (*effects, *adopted)), ""
    if request.contact == PRIOR:
        return _prior(bench, (*effects, *adopted)), ""
    registry = _registry(db)
    if request.contact in (None, REGISTERED):
        version = None if registry is None else model_in_use(session, registry, bench.kind)
        if version is not None and registry is not None:
            return _registered_with(session, registry, version, effects, adopted)
        if request.contact == REGISTERED:
            raise LookupError(_none_in_use(bench.kind))
        prior = _prior(bench, (*effects, *adopted))
        note = (
            f"contact: {prior.label}, each drawn from its likely range; no model "
            f"is in use for the {bench.kind}"
        )
        return prior, "; ".join(filter(None, (note, _lost_models(session, db))))
    return _registered_with(session, *_named_version(db, request.contact), effects, adopted)


def check_contact(db: str, name: str) -> None:
    """Raises `LookupError` for a name that no twin can take: it is no law, and no version that is
    registered."""
    from ...twin.contact.laws import LAWS

    if name not in (PRIOR, REGISTERED, *LAWS):
        _named_version(db, name)


def _lost_models(session: Session | None, db: str) -> str:
    """What the registry has lost of the versions that the store lists; empty for nothing."""
    from ..common.registered_models import lost_versions, lost_words

    if session is None:
        return ""
    registry = registry_of(db)
    return lost_words(lost_versions(session, registry), registry)


def _named_version(db: str, name: str) -> tuple[Registry, Version]:
    """The registry and the version that a name means in it. Raises `LookupError` for an unknown
    one."""
    from ...training.registry.listing import chosen
    from ...twin.contact.laws import LAWS

    registry = _registry(db)
    if registry is None:
        raise LookupError(
            f"no law of contact {name!r}, and no models; laws: {', '.join((PRIOR, *LAWS))}"
        )
    return registry, chosen(registry.versions(), name.removeprefix("models:/"))


def _none_in_use(bench_kind: str) -> str:
    return f"no model is in use for the {bench_kind}; make one so: pyroshock promote MODEL@VERSION"


def _coupled(contact: ContactStage, plates: PlateStage) -> ContactStage:
    """The contact on the modes of the plates. Raises `ValueError` for one that is not solved in
    time."""
    from ...twin.contact.stage import LawContact

    if isinstance(contact, PriorContact) or (
        isinstance(contact, LawContact) and contact.law == "hertz"
    ):
        return CoupledContact(contact, plates)
    raise ValueError(
        f"--coupled with the contact {contact.label!r}, which is not solved "
        f"in time: expected --contact prior or hertz"
    )


def _registered_with(
    session: Session | None,
    registry: Registry,
    version: Version,
    effects: tuple[Effect, ...],
    adopted: tuple[Effect, ...],
) -> tuple[ContactStage, str]:
    """A registered model with effects, and what is to be said of it: adopted ones act where it has
    not learned them."""
    from .adopted_effects import learned_by

    learned = learned_by(session, version, adopted)
    acting = (*effects, *(effect for effect in adopted if effect not in learned))
    kind = velocity_kind_of(session, version)
    integrated = (
        f"{version.label} takes velocities integrated to the peak of the "
        f"force: it is asked with the one that belongs "
        "to the velocity before contact by its own pulse and the plate's mobility"
    )
    notes = (
        _learned(learned, version.label),
        integrated if kind == INTEGRATED else "",
        note_of(session, version),
    )
    return _registered(session, registry, version, kind, acting), "; ".join(filter(None, notes))


def _learned(effects: tuple[Effect, ...], label: str) -> str:
    """An adopted effect that is in the measured pulses already would act twice."""
    if not effects:
        return ""
    names = ", ".join(effect.id for effect in effects)
    return (
        f"{names} (adopted) does not act on {label}, which has learned it from measured pulses of "
        "this bench; --effect adds it, --contact prior uses the law with it"
    )


def registered_contact(
    session: Session | None, db: str, name: str, in_use: str | None = None
) -> ContactStage:
    """The registered model "NAME@VERSION", or the one in use for a kind of bench, asked with
    velocities as its dataset had them. Raises `LookupError`."""
    from ...training.registry.listing import chosen

    registry = _registry(db)
    if registry is None:
        raise LookupError(f"no registered model {name!r}: none is registered (pyroshock train)")
    if in_use is None:
        return _registered(session, registry, chosen(registry.versions(), name))
    version = model_in_use(session, registry, in_use)
    if version is None:
        raise LookupError(_none_in_use(in_use))
    return _registered(session, registry, version)


def _law(name: str, effects: tuple[Effect, ...]) -> ContactStage:
    from ...twin.contact.stage import LawContact

    return LawContact(name, effects=effects)


def _prior(bench: Bench, effects: tuple[Effect, ...]) -> ContactStage:
    """A hammer's mass is uncertain as well, for a hand holds it."""
    return PriorContact(effects, hand_held=bench.kind == "hammer")


def _registry(db: str) -> Registry | None:
    """Where models were registered; None where there are none, without a look at MLflow."""
    registry = registry_of(db)
    return None if registry.connection.nothing_there else registry


def _registered(
    session: Session | None,
    registry: Registry,
    version: Version,
    velocity_kind: str = BEFORE_CONTACT,
    effects: tuple[Effect, ...] = (),
) -> ContactStage:
    from ...dataset.snapshot import read_snapshot
    from ...training.registry.contact_stage import RegisteredContact

    own = None
    if version.dataset.predictor_set not in SHIPPED and session is not None:
        own = read_snapshot(session, version.dataset.hash).predictors
    return RegisteredContact(registry.load(version), own, velocity_kind, effects)


def _plates(
    bench: Bench, material: ElasticMaterial, db: str, request: TwinRequest
) -> tuple[PlateStage, str]:
    effects = _of_stage(request, "plate")
    if bench.modes is not None:
        # A measured table is known better than a model: its frequencies to a line's width.
        spread = PlateSpread(frequency=0.002, damping=0.2)
        if request.chain_height_m:
            raise ValueError(
                f"chain height {1e3 * request.chain_height_m:g} mm: the modal table knows the "
                "plate's shapes at the points where they were measured only; leave the height out, "
                "or the table (--plate MATERIAL)"
            )
        return PlateStage({material.name: bench.modes}, effects, spread, bench.modes_source), ""
    drawing = bench.drawing.at(request.impact_points, request.sensors).raised(
        request.chain_height_m
    )
    plate = _drawn_plate(bench, material, db, request)
    return PlateStage(
        {material.name: plate}, effects, label=f"finite elements ({drawing.source})"
    ), _of(drawing)


def _drawn_plate(
    bench: Bench, material: ElasticMaterial, db: str, request: TwinRequest
) -> ModalPlate:
    drawing = bench.drawing.at(request.impact_points, request.sensors).raised(
        request.chain_height_m
    )
    return solved(drawing, material, MAX_MODE_HZ, plates_folder(db))


def plates_folder(db: str) -> Path:
    """Where solved plates of a store are kept."""
    return storage_for(db, user_environment()).work / "plates"


def _of(drawing: PlateDrawing) -> str:
    points = ", ".join(
        f"{name} ({x:.3g}, {y:.3g})"
        for name, (x, y) in {**drawing.impact_points, **drawing.sensors}.items()
    )
    return f"plate: {drawing.source}, {drawing.thickness_m * 1e3:g} mm; points in m: {points}"


def solved(
    drawing: PlateDrawing, material: ElasticMaterial, highest_hz: float, folder: Path
) -> ModalPlate:
    """Modes of a plate up to a frequency, of the finite element model, kept in `folder`."""
    from ...parallel.task import one_thread
    from ...twin.plate.build import ConstantDamping, PlateBuild, named_points
    from ...twin.plate.modes import cached_plate

    build = PlateBuild(
        outline_m=drawing.outline_m,
        thickness_m=drawing.thickness_m,
        material=material,
        impact_points=named_points(drawing.impact_points),
        sensors=named_points(drawing.sensors),
        damping=ConstantDamping(drawing.damping_ratio),
    )
    # Dense blocks of some hundred rows: more threads of linear algebra only get into each other's
    # way, ten times over.
    with one_thread():
        return cached_plate(build, highest_hz, folder)
