"""A twin of what is in the store: bench, materials, the model in use, the scatter of its measured shots."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...dataset.stored_bench import by_name, stored_materials
from ...training.place import place_beside
from ...twin.chain import Twin, default_lines
from ...twin.effects import Effect, checked_effects
from ...twin.launch import GunStage
from ...twin.materials import THESIS, Material
from ...twin.plates import PlateSpread, PlateStage
from ...twin.sensors.chain import SensorChain
from ...twin.setting import Setting
from ..models.training import registry_of
from .benches import Bench, PlateDrawing, Point, bench_of_campaign, bench_of_file, shipped_bench, with_modes

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

    from ...schema.session import Store
    from ...training.records import Version
    from ...training.registry.registry import Registry
    from ...twin.gun.calibration import VelocityCalibration
    from ...twin.plate.modal import ModalPlate
    from ...twin.strikes import ContactStage

#: Without a model: what is likely of the contact, narrowed by measured shots (`PriorContact`).
PRIOR = "prior"
REGISTERED = "registered"
#: A solved plate has the modes up to so many times the highest line: one beyond moves that line's oscillator by a
#: fifteenth of what it moves the plate. But none that the rate of 100 kHz shows badly.
MODES_OVER_LINES, MAX_MODE_HZ = 4.0, 20_000.0
#: So many measured shots teach the gun; with less its scatter is that of the errors in Table 5.1.
_ENOUGH_SHOTS, THESIS_VELOCITY_SPREAD = 5, 0.046


@dataclass(frozen=True)
class TwinRequest:
    """What a user asks of a twin; what is None or empty is the store's, else the shipped bench's.

    `adopted`: effects that diagnoses have left to the campaign's bench act, too. `coupled`: contact law and plate are
    solved together, which takes a law that is solved in time (hertz), or the prior.
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
    coupled: bool = False


@dataclass(frozen=True, eq=False)
class BuiltTwin:
    """A twin, and what settings for it are made of. `notes` are for the user: what was assumed."""

    twin: Twin
    bench: Bench
    plate: Material
    materials: Mapping[str, Material]
    notes: tuple[str, ...] = field(default=())

    def material(self, name: str) -> Material:
        """By name or alias. Raises `LookupError` naming those there are."""
        return _material_named(self.materials, name)

    def setting(self, **own: Any) -> Setting:
        """A setting on this twin's plate; `own` are the other fields of `Setting`."""
        drawing = self.bench.drawing
        mass = drawing.area_m2 * drawing.thickness_m * self.plate.density_kg_m3
        return Setting(plate=self.plate, plate_thickness_m=drawing.thickness_m, plate_mass_kg=mass, **own)


def twin_of(store: Store | None, db: str, request: TwinRequest) -> BuiltTwin:
    """The twin; without a store, of the shipped bench. Raises `LookupError`, `ValueError` for what there is not."""
    if store is None:
        if request.campaign is not None:
            raise LookupError(f"no campaign {request.campaign!r}: there is no store at {db}")
        return _built(None, shipped_bench(), by_name(THESIS.values(), {}), db, request)
    with store.reading() as session:
        bench = bench_of_campaign(session, request.campaign)
        return _built(session, bench, stored_materials(session), db, request)


def _material_named(materials: Mapping[str, Material], name: str) -> Material:
    if name.lower() not in materials:
        known = ", ".join(dict.fromkeys(material.name for material in materials.values()))
        raise LookupError(f"no material {name!r}; there are: {known} (pyroshock materials)")
    return materials[name.lower()]


def _built(
    session: Session | None, bench: Bench, materials: Mapping[str, Material], db: str, request: TwinRequest
) -> BuiltTwin:
    if request.bench is not None:
        bench = bench_of_file(request.bench, bench)
    if request.modes is not None:
        bench = with_modes(bench, request.modes)
    plate = _material_named(materials, request.plate or bench.plate_material)
    adopted, adopted_notes = _adopted(session, bench, request)
    request = replace(request, effects=(*request.effects, *(e for e in adopted if e.stage() != "contact")))
    gun, shots_note = _gun(session, bench, request)
    contact, contact_note = _contact(session, bench, db, request, tuple(e for e in adopted if e.stage() == "contact"))
    plates, plate_note = _plates(bench, plate, db, request)
    if request.coupled:
        contact = _coupled(contact, plates)
    twin = Twin(
        contact=contact,
        gun=gun,
        plate=plates,
        sensors=SensorChain.of(_of_stage(request, "sensor")),
        frequency_hz=np.array(request.frequency_hz) if request.frequency_hz else default_lines(),
        q=request.q,
    )
    notes = tuple(note for note in (*adopted_notes, shots_note, contact_note, plate_note) if note)
    return BuiltTwin(twin, bench, plate, materials, notes)


def _adopted(session: Session | None, bench: Bench, request: TwinRequest) -> tuple[tuple[Effect, ...], tuple[str, ...]]:
    """Of the campaign's bench; a bench or a plate given by hand is another one."""
    from .adopting import taken_up

    if session is None or bench.campaign is None or request.bench is not None or not request.adopted:
        return (), ()
    other_plate = request.modes is not None or (request.plate or bench.plate_material) != bench.plate_material
    return taken_up(session, bench.campaign, request.effects, ("plate",) if other_plate else ())


def _of_stage(request: TwinRequest, stage: str) -> tuple[Effect, ...]:
    return tuple(effect for effect in request.effects if effect.stage() == stage)


def _gun(session: Session | None, bench: Bench, request: TwinRequest) -> tuple[GunStage, str]:
    """The gun, corrected by the campaign's measured shots; with the thesis's scatter where there are too few."""
    from ...twin.gun.effect import GunEffect

    effects = checked_effects(_of_stage(request, "gun"), GunEffect)
    stage = GunStage(bench.gun, THESIS_VELOCITY_SPREAD, effects, bench.gun_source)
    twice = bench.gun.efficiency < 1 and bool(effects)
    also = f"; the bench's efficiency {bench.gun.efficiency:g} acts beside the gun's effects" if twice else ""
    calibration = _calibration(session, bench.campaign, stage)
    if calibration is None:
        return stage, f"velocity spread {THESIS_VELOCITY_SPREAD:.1%}: the thesis's five shots{also}"
    return replace(stage, calibration=calibration), f"velocity corrected by {calibration.shots} measured shots{also}"


def _calibration(session: Session | None, campaign: str | None, gun: GunStage) -> VelocityCalibration | None:
    """Of the shots that were measured and that the gun says to leave the barrel; None for less than five."""
    from ...schema.listings import iter_shots
    from ...twin.gun.calibration import VelocityCalibration

    if session is None or campaign is None:
        return None
    shots = [shot for shot in iter_shots(session, campaign) if (shot["measured_velocity_m_s"] or 0) > 0]
    names = ("tank_pressure_pa", "bullet_mass_kg", "measured_velocity_m_s")
    pressure, mass, measured = (np.array([shot[name] for shot in shots], dtype=np.float64) for name in names)
    predicted = gun.fired(pressure, mass) if shots else np.zeros(0)
    left = predicted > 0
    if left.sum() < _ENOUGH_SHOTS:
        return None
    return VelocityCalibration.of(pressure[left], mass[left], measured[left], predicted[left])


def _contact(
    session: Session | None, bench: Bench, db: str, request: TwinRequest, adopted: tuple[Effect, ...] = ()
) -> tuple[ContactStage, str]:
    """A registered model where there is a champion, or one is asked for; else a law, on which effects act, or the prior
    of the contact."""
    from ...twin.contact.laws import LAWS
    from ..models.withdrawn import note_of

    effects = _of_stage(request, "contact")
    if request.coupled and request.contact is None:  # a model has learned pulses, and knows no plate to solve against
        request = replace(request, contact=PRIOR)
    if request.contact is not None and request.contact in LAWS:
        return _law(request.contact, (*effects, *adopted)), ""
    if request.contact == PRIOR or effects:
        return _prior(session, bench, (*effects, *adopted)), ""
    idle = _idle(adopted)
    registry = _registry(db)
    if request.contact in (None, REGISTERED):
        found = None if registry is None else registry.champion("gun")
        if found is not None and registry is not None:
            return _registered(session, registry, found), _joined(idle, note_of(session, found))
        if request.contact == REGISTERED:
            raise LookupError("no model is in use for the gun; make one so: pyroshock promote MODEL VERSION")
        prior = _prior(session, bench, adopted)
        return prior, f"contact: {prior.label}, each drawn from its likely range; no model is in use for the gun"
    if registry is None:
        laws = ", ".join((PRIOR, *LAWS))
        raise LookupError(f"no law of contact {request.contact!r}, and no models; laws: {laws}")
    from ...training.listing import chosen

    version = chosen(registry.versions(), request.contact.removeprefix("models:/"))
    return _registered(session, registry, version), _joined(idle, note_of(session, version))


def _coupled(contact: ContactStage, plates: PlateStage) -> ContactStage:
    """The contact on the modes of the plates. Raises `ValueError` for one that is not solved in time."""
    from ...twin.contact.prior import PriorContact
    from ...twin.contact.stage import LawContact
    from ...twin.coupled_contact import CoupledContact

    if isinstance(contact, PriorContact) or (isinstance(contact, LawContact) and contact.law == "hertz"):
        return CoupledContact(contact, plates)
    raise ValueError(
        f"--coupled with the contact {contact.label!r}, which is not solved in time: expected --contact prior or hertz"
    )


def _joined(*notes: str) -> str:
    return "; ".join(filter(None, notes))


def _idle(adopted: tuple[Effect, ...]) -> str:
    """A registered model has learned from measured pulses: it holds what the bench does."""
    if not adopted:
        return ""
    names = ", ".join(effect.id for effect in adopted)
    return f"{names} does not act on a registered model, which learned from measured pulses; --contact prior uses it"


def registered_contact(session: Session | None, db: str, name: str, in_use: str | None = None) -> ContactStage:
    """The registered model "NAME@VERSION", or the one `in_use` for a predictor set. Raises `LookupError`."""
    from ...training.listing import chosen

    registry = _registry(db)
    if registry is None:
        raise LookupError(f"no registered model {name!r}: none is registered (pyroshock train)")
    if in_use is None:
        return _registered(session, registry, chosen(registry.versions(), name))
    found = registry.champion(in_use)
    if found is None:
        raise LookupError(f"no model is in use for the {in_use}; make one so: pyroshock promote MODEL VERSION")
    return _registered(session, registry, found)


def _law(name: str, effects: tuple[Effect, ...]) -> ContactStage:
    from ...twin.contact.stage import LawContact

    return LawContact(name, effects=effects)


def _prior(session: Session | None, bench: Bench, effects: tuple[Effect, ...]) -> ContactStage:
    """A hammer's mass is uncertain as well, for a hand holds it."""
    from ...schema.campaigns import Campaign
    from ...schema.listings import get_campaign_id
    from ...twin.contact.prior import PriorContact

    if session is None or bench.campaign is None:
        return PriorContact(effects)
    campaign = session.get_one(Campaign, get_campaign_id(session, bench.campaign))
    return PriorContact(effects, hand_held=campaign.kind == "hammer")


def _registry(db: str) -> Registry | None:
    """Where models were registered; None where there are none, without a look at MLflow."""
    registry = registry_of(db)
    return None if registry.connection.nothing_there else registry


def _registered(session: Session | None, registry: Registry, version: Version) -> ContactStage:
    from ...dataset.predictors import SHIPPED
    from ...dataset.snapshot import read_snapshot
    from ...training.contact_stage import RegisteredContact

    own = None
    if version.dataset.predictor_set not in SHIPPED and session is not None:
        own = read_snapshot(session, version.dataset.hash).predictors
    return RegisteredContact(registry.load(version), own)


def _plates(bench: Bench, material: Material, db: str, request: TwinRequest) -> tuple[PlateStage, str]:
    effects = _of_stage(request, "plate")
    if bench.modes is not None:
        # A measured table is known better than a model: its frequencies to a line's width.
        spread = PlateSpread(frequency=0.002, damping=0.2)
        return PlateStage({material.name: bench.modes}, effects, spread, bench.modes_source), ""
    drawing = bench.drawing.at(request.impact_points, request.sensors)
    lines = request.frequency_hz or tuple(default_lines().tolist())
    highest = min(MODES_OVER_LINES * max(lines), MAX_MODE_HZ)
    plate = solved(drawing, material, highest, plates_folder(db))
    return PlateStage({material.name: plate}, effects, label=f"finite elements ({drawing.source})"), _of(drawing)


def plates_folder(db: str) -> Path:
    """Where solved plates of a store are kept."""
    return place_beside(db, os.environ).work / "plates"


def _of(drawing: PlateDrawing) -> str:
    points = ", ".join(
        f"{name} ({x:.3g}, {y:.3g})" for name, (x, y) in {**drawing.impact_points, **drawing.sensors}.items()
    )
    return f"plate: {drawing.source}, {drawing.thickness_m * 1e3:g} mm; points in m: {points}"


def solved(drawing: PlateDrawing, material: Material, highest_hz: float, folder: Path) -> ModalPlate:
    """Modes of a plate up to a frequency, of the finite element model, kept in `folder`."""
    import scipy.linalg  # noqa: F401 - its own BLAS must be there to be limited
    from threadpoolctl import threadpool_limits

    from ...twin.plate.build import PlateBuild, places
    from ...twin.plate.cache import cached_plate
    from ...twin.plate.damping import ConstantDamping

    build = PlateBuild(
        outline_m=drawing.outline_m,
        thickness_m=drawing.thickness_m,
        material=material,
        impact_points=places(drawing.impact_points),
        sensors=places(drawing.sensors),
        damping=ConstantDamping(drawing.damping_ratio),
    )
    # Dense blocks of some hundred rows: more threads of linear algebra only get into each other's way, ten times over.
    with threadpool_limits(limits=1):
        return cached_plate(build, highest_hz, folder)
