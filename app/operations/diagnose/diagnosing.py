"""A diagnosis: of a campaign in the store, which keeps it, or of a folder, which keeps nothing."""

from __future__ import annotations

from collections import Counter
from contextlib import ExitStack
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sqlalchemy import select

from ....schema.conditions import get_campaign_id, has_campaign, list_campaign_names
from ....schema.diagnoses import Diagnosis
from ....twin.effects import catalogue
from ..operation import Progress
from .request import (
    IN_USE,
    MODELS,
    DiagnosisRequest,
    considered_effects,
    restriction_sentences,
    restrictions_among,
)
from .stored import verdict_to_json

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

    from ....diagnosis.options import Options
    from ....diagnosis.record import CampaignRecord
    from ....diagnosis.verdict import Verdict
    from ....schema.session import Store
    from ....twin.contact_interface import ContactStage
    from ...twins.benches import PlateDrawing


#: A plate without places is compared at its lowest modes alone, which lie below this on a bench.
_DIAGNOSED_HZ = 5_000.0


def is_stored(store: Store | None, target: str) -> bool:
    """Whether `target` names a campaign of the store."""
    return store is not None and store.read(lambda session: has_campaign(session, target))


def record_of(store: Store | None, db: str, request: DiagnosisRequest) -> CampaignRecord:
    """The campaign as it is diagnosed: the store's, else the folder's.

    Raises `LookupError` for what is neither, and as the ingest does for a folder that it refuses.
    """
    from ....diagnosis.reading import read_campaign, read_folder

    if store is not None and is_stored(store, request.campaign):
        with store.reading() as session:
            record = read_campaign(session, request.campaign)
    elif Path(request.campaign).is_dir():
        record = read_folder(Path(request.campaign))
    else:
        names = (
            ", ".join(sorted(store.read(list_campaign_names)) if store is not None else ())
            or "none"
        )
        raise LookupError(
            f"no campaign and no folder {request.campaign!r}; campaigns: "
            f"{names} (pyroshock ingest FOLDER)"
        )
    if request.modes is not None or request.bench is not None:
        return _with_own_plate(record, db, request)
    return _with_solved_plate(record, db)


def _with_own_plate(record: CampaignRecord, db: str, request: DiagnosisRequest) -> CampaignRecord:
    """With the modal table, or the solved drawing, that the user brings."""
    from ...twins.benches import bench_of_file, shipped_bench, with_modes

    bench = shipped_bench()
    with ExitStack() as files:
        if request.bench is not None:
            bench = bench_of_file(files.enter_context(request.bench.as_path()), bench)
        if request.modes is not None:
            bench = with_modes(bench, files.enter_context(request.modes.as_path()))
    if bench.modes is not None:
        return replace(record, plate=bench.modes)
    from ...twins.building import MAX_MODE_HZ, plates_folder, solved

    return replace(
        record,
        plate=solved(
            bench.drawing,
            record.materials[bench.plate_material.lower()],
            MAX_MODE_HZ,
            plates_folder(db),
        ),
        plate_points_known=_points_given(bench.drawing),
        plate_model_material=bench.plate_material,
    )


def _points_given(drawing: PlateDrawing) -> bool:
    """Whether somebody said where the plate is hit and where its sensors stand."""
    from ...twins.benches import PlateDrawing

    assumed = PlateDrawing.of(drawing.outline_m, drawing.source)
    return drawing.impact_points != assumed.impact_points and drawing.sensors != assumed.sensors


def _with_solved_plate(record: CampaignRecord, db: str) -> CampaignRecord:
    """With the plate of the campaign's own outline, where it has no modal table and accelerations
    to compare."""
    drawn = bool(record.plate_outline_m) and any(run.accelerations for run in record.runs)
    material = _struck_material(record)
    if record.plate is not None or not drawn or material is None:
        return record
    from ...twins.benches import PlateDrawing
    from ...twins.building import plates_folder, solved

    drawing = PlateDrawing.of(
        record.plate_outline_m, f"campaign {record.name}", record.plate_thickness_m
    )
    plate = solved(drawing, record.materials[material], _DIAGNOSED_HZ, plates_folder(db))
    return replace(record, plate=plate, plate_points_known=False, plate_model_material=material)


def _struck_material(record: CampaignRecord) -> str | None:
    """The plate's material in `[bench.plate]` where any run strikes it, else that of most
    configurations."""
    struck = [
        name
        for item in record.configurations
        if (name := record.plate_material_of(item)) is not None
    ]
    if not struck or record.plate_material in struck:
        return record.plate_material
    return Counter(struck).most_common(1)[0][0]


def simulator_of(store: Store | None, db: str, kind: str, text: str | None) -> ContactStage | None:
    """The registered model that `--simulator` names, as a contact stage; None for the nominal
    stages.

    Raises `LookupError`, `ValueError` for what there is not.
    """
    if text is None or text == "nominal":
        return None
    from ...twins.building import registered_contact

    name = text.removeprefix(MODELS)
    in_use = kind if name.partition("@")[0] == IN_USE else None
    if store is None:
        return registered_contact(None, db, name, in_use)
    with store.reading() as session:
        return registered_contact(session, db, name, in_use)


def run_diagnosis(
    store: Store | None, db: str, request: DiagnosisRequest, progress: Progress | None = None
) -> Verdict:
    """The diagnosis. Raises `ValueError` and `LookupError` for what cannot be diagnosed, in one
    line: also for an effect of `with_effects` and `without_effects` that there is not, or that the
    campaign cannot show."""
    from ....diagnosis.diagnose import Options, diagnose
    from .plot_builder import pictures_of

    record = record_of(store, db, request)
    options = Options(
        seed=request.seed,
        tolerances=request.tolerances,
        uncertain=request.uncertain,
        contact=simulator_of(store, db, record.kind, request.simulator),
        explore=True,
    )
    verdict = diagnose(
        record, options=_restricted(record, options, request), progress=progress, draw=pictures_of
    )
    sentences = restriction_sentences(request.with_effects, request.without_effects)
    return replace(verdict, assumptions=(*sentences, *verdict.assumptions))


def _restricted(record: CampaignRecord, options: Options, request: DiagnosisRequest) -> Options:
    """The options with the effects that the user names. Whatever method diagnoses sees the effects
    that are left."""
    if not (request.with_effects or request.without_effects):
        return options
    from ....diagnosis.chain import stages_of

    stages, _ = stages_of(record, options)
    detectable = [name for name in catalogue() if any(name in stage.shows for stage in stages)]
    effects = considered_effects(
        record.name, detectable, request.with_effects, request.without_effects
    )
    return replace(options, catalogue=effects, without=tuple(request.without_effects))


def keep(store: Store, verdict: Verdict, request: DiagnosisRequest | None = None) -> int:
    """Store a diagnosis with its campaign, and what its page draws; its key.

    What was `request` is kept beside it, so that a what-if diagnosis asks the same; files are not.
    """
    report, details = verdict_to_json(verdict)
    if request is not None:
        details["options"] = request.model_dump(
            mode="json", exclude={"campaign", "adopt", "modes", "bench"}
        )

    def add(session: Session) -> int:
        row = Diagnosis(
            campaign_id=get_campaign_id(session, verdict.campaign),
            simulator=verdict.simulator,
            diagnosed_at=datetime.now(UTC),
            report=report,
            details=details,
        )
        session.add(row)
        session.flush()
        return row.id

    return store.write(add)


def report_json(verdict: Verdict) -> dict[str, Any]:
    """The report as scripts read it; a number that JSON has not (NaN) is null."""
    return verdict_to_json(verdict)[0]


def last_report(session: Session, campaign: str) -> dict[str, Any] | None:
    """The newest diagnosis of a campaign that considered all effects; None where there is none.

    A what-if diagnosis (`--with`, `--without`) answers another question. Raises `LookupError` for
    an unknown campaign.
    """
    key = get_campaign_id(session, campaign)
    query = (
        select(Diagnosis.report).where(Diagnosis.campaign_id == key).order_by(Diagnosis.id.desc())
    )
    reports = session.scalars(query)
    return next(
        (report for report in reports if not restrictions_among(report["assumptions"])), None
    )
