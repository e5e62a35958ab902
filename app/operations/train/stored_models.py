"""Registered models: one shown with its figures and searches, one deleted, lost ones recovered."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from ....schema.person_roles import ENGINEER
from ..fields import Presentation, request_field
from ..laboratory import Laboratory
from ..operation import (
    FormPage,
    Lines,
    Operation,
    Outcome,
    Output,
    Progress,
    Request,
    Result,
    ResultTable,
)
from ..sentence import Sentence
from .promote import NamedVersion

if TYPE_CHECKING:
    from ....training.registry.records import Version
    from ....training.tuning.trials import SettingsSearch
    from ...figures.figure import Figure


class ShownModel(Request):
    """A registered version, by its name."""

    model: Annotated[str, Field(min_length=1, max_length=1000)] = request_field(
        help="Name the version, as MODEL@VERSION; MODEL@champion is the version in use, and MODEL "
        "alone is the newest version.",
        presentation=Presentation(
            positional=True, metavar="MODEL@VERSION", completion="model_versions"
        ),
    )


@dataclass(frozen=True, eq=False)
class ModelVersion(Result):
    """A version with its figures, its settings, and the searches of its training."""

    version: Version
    floors: Mapping[str, str]
    settings: Mapping[str, Any]
    histories: Mapping[str, Any]
    searches: Mapping[str, SettingsSearch]

    @property
    def row(self) -> dict[str, Any]:
        """As pages have it (`figures.version_row`)."""
        from .figures import version_row

        return version_row(self.version, self.floors)

    def notes(self) -> Sequence[str]:
        """Of which dataset, split and seed it is."""
        version = self.version
        return (
            f"{version.label}, dataset {version.dataset.name}, split {version.split}, seed "
            f"{version.seed}",
        )

    def sentences(self) -> Sequence[Sentence]:
        """Whether it is usable, how large its errors are, and whether its bands hold."""
        from .wording import version_sentences

        return version_sentences(self.row)

    def tables(self) -> Sequence[ResultTable | Lines]:
        """Figures, settings, and what each search tried."""
        from .searches import importance_sentence, search_sentence, settings_rows
        from .wording import version_tables

        settings = settings_rows(self.settings, self.searches)
        none = "no settings: older software trained it, or it has none"
        lines = [
            line
            for part, search in self.searches.items()
            for line in (search_sentence(part, search), importance_sentence(search))
        ]
        version = self.version
        source = f"dataset {version.dataset.name}, split {version.split}, seed {version.seed}"
        figures = [
            replace(table, title=f"{version.label}, {source}\n{table.title}")
            for table in version_tables(self.row)
        ]
        return (*figures, ResultTable("Settings", settings, none), Lines("", lines))

    def figures(self) -> Sequence[Figure]:
        """The trials of its searches, where it has any."""
        from .charts import searches_figure

        return (searches_figure(self.searches),) if self.searches else ()

    def to_json(self) -> dict[str, Any]:
        """As `pyroshock models show --json` prints it, with every trial of the searches."""
        from .tables import json_row

        return {
            **json_row(self.version, self.floors),
            "settings": dict(self.settings),
            "histories": self.histories,
            "searches": {part: search.as_json() for part, search in self.searches.items()},
        }


def _show(request: ShownModel, laboratory: Laboratory, _: Progress) -> ModelVersion:
    from ...common.model_registry import models_extra, registry_of

    with models_extra():
        from ....training.registry.listing import chosen

        registry = registry_of(laboratory.db)
        version = chosen(registry.versions(), request.model)
        return ModelVersion(
            version,
            registry.floors(version.dataset.hash, version.seed),
            registry.fit_settings(version),
            registry.fit_histories(version),
            registry.searches(version),
        )


def _plot(shown: ModelVersion, path: Path) -> None:
    if not shown.searches:
        raise LookupError(
            f"{shown.version.label} has no trials to draw: nothing was searched, or older software "
            "trained it"
        )
    shown.write_figure(path)


class DeletedVersion(NamedVersion):
    """A version that is to be deleted."""


def _unused(request: DeletedVersion, laboratory: Laboratory) -> str:
    from ...common.model_registry import models_extra, needed
    from .deletion import unused_version

    with models_extra():
        needed(laboratory.db)
    return f"model {unused_version(laboratory.db, request.label).label}"


def _delete(request: DeletedVersion, laboratory: Laboratory, _: Progress) -> Outcome:
    from .deletion import delete_version

    label = delete_version(laboratory.db, request.label).label
    return Outcome((f"model {label} is deleted",), {"model": label}, "/models")


def _recover(_: Request, laboratory: Laboratory, __: Progress) -> Outcome:
    from ...common.model_registry import models_extra, registry_of
    from ...common.registered_models import recover_lost

    with models_extra():
        registry = registry_of(laboratory.db)
        outcomes = tuple(recover_lost(laboratory.store, registry))
    lines = tuple(f"{label} {outcome}" for label, outcome in outcomes)
    nothing = "nothing is lost: the registry has every version that the store lists"
    data = [{"model": label, "outcome": outcome} for label, outcome in outcomes]
    return Outcome(lines or (nothing,), data)


MODEL_SHOW = Operation(
    name="model-show",
    request=ShownModel,
    run=_show,
    help="""Show one version of a model: its figures, and the settings of its training, with the
    trials of the searches that chose some of them.

    `MODEL@champion` is the version in use, and MODEL alone is the newest version. The JSON has
    every trial of the search with its settings, its score and its duration in seconds.""",
    example="pyroshock models show gp@1 --plot search.png",
    command=("models", "show"),
    route=("GET", "/versions/{model}"),
    outputs=(
        Output(
            "plot",
            "Draw the trials of the search for settings, and the importance of each setting, into "
            "FILE.png.",
            _plot,
        ),
    ),
    needs_store=False,
    absent={"form": "its page is the answer itself, which an address shows"},
)
MODEL_DELETE = Operation(
    name="model-delete",
    changes_elsewhere=True,
    request=DeletedVersion,
    run=_delete,
    help="""Delete one version of a model from the registry. The model in use is refused.

    The number of a deleted version is not given again. Predictions, diagnoses and reports that were
    made with it stay.""",
    example="""pyroshock train rehearsal-pulses --models linear --split configurations
pyroshock models delete linear@1 --yes""",
    command=("models", "delete"),
    route=("POST", "/models/{model}/{version}/delete"),
    deletes=_unused,
    needs_store=False,
    form=FormPage("/models/{model}/{version}/delete", "delete", "/models/{model}/{version}/delete"),
)
MODEL_RECOVER = Operation(
    name="model-recover",
    role=ENGINEER,
    changes_elsewhere=True,
    request=Request,
    run=_recover,
    help="""Register the surviving files of versions again that the store lists and the registry has
    lost.

    Every file is held against the SHA-256 that was registered of it. Numbers of versions are kept
    where they are free. No model is put in use: promote the one that was. Histories of trainings
    and promotions are not in the files.""",
    example="pyroshock models recover",
    command=("models", "recover"),
    route=("POST", "/models/recover"),
    absent={"form": "whoever keeps the files of the registry recovers it, on the command line"},
)
