"""Search the settings of the bench that give a prescribed spectrum."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from ....files.atomic_write import write_text
from ....schema.person_roles import OPERATOR
from ...common.number_format import finite
from ..faults import about_field
from ..laboratory import Laboratory
from ..operation import FormPage, Operation, Output, Progress, Result
from .request import Tuning
from .service import TunedSettings, search_settings


def check(request: Tuning, laboratory: Laboratory) -> None:
    """Raises `LookupError` for names that the store does not have: the search would end without a
    result."""
    from ....schema.listings import get_campaign_id

    request.check_names(laboratory)
    with laboratory.store.reading() as session, about_field("measured"):
        for name in request.measured:
            get_campaign_id(session, name)


def _run(request: Tuning, laboratory: Laboratory, progress: Progress) -> TunedSettings:
    progress(0, 0, "building the twin")
    with request.twin_request() as twin:
        return search_settings(
            laboratory.store, laboratory.db, request.prescribed(), request, twin, progress
        )


def _write_avoid(settings: TunedSettings, path: Path) -> None:
    from .bench_adapter import avoid_json

    rows = [avoid_json(item) for item in settings.tuned.avoid]
    write_text(path, json.dumps(finite(rows), indent=2) + "\n")


def _label(request: Any) -> str:
    path = request.target.path
    return "to a spectrum" if path is None else f"to {path.name}"


TUNE: Operation[Tuning, TunedSettings] = Operation(
    name="tune",
    role=OPERATOR,
    request=Tuning,
    run=_run,
    check=check,
    help="Search the settings of the bench that give a prescribed spectrum.\n\n"
    "The settings are ranked, each with the probability that every line fits. The first line says "
    "whether any setting meets the target, with which probability, and what stands in the way if "
    "none does; the exit code is 1 then. Settings that the bench must not fire are never proposed. "
    "A shot that was fired updates the next proposal.",
    example="pyroshock tune --target examples/specifications/component.csv --measured rehearsal "
    "--plot spectra.png",
    route=("POST", "/tune"),
    long=True,
    steps="settings",
    outputs=(
        Output(
            "avoid",
            "Write the settings that must be avoided to FILE, as JSON.",
            _write_avoid,
        ),
        Output(
            "plot",
            "Draw the spectra of the best settings into FILE.",
            Result.write_figure,
            missing=lambda settings: (
                "" if settings.tuned.proposals else "the bench can fire no setting"
            ),
        ),
    ),
    label=_label,
    form=FormPage("/tune", "tune", "/tune"),
    result_page="/tune/{job}",
)
