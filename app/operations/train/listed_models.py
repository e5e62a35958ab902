"""Registered models in lists: versions with their figures, promotions, and one version's held-out
pulses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

from ..fields import Presentation, request_field
from ..laboratory import Laboratory
from ..operation import Operation, Progress, Request, Result, ResultTable, Rows
from ..twin_fields import Word
from .promote import NamedVersion

if TYPE_CHECKING:
    from ....training.registry.records import Version

_NO_MODELS = "no models yet; train some: pyroshock train DATASET"
_ON_ITS_PAGE = {"form": "It changes nothing; the pages of models show it."}


class ModelList(Request):
    """Which versions are listed."""

    dataset: Word | None = request_field(
        None,
        help="List only models that were trained on this dataset.",
        presentation=Presentation(metavar="NAME", completion="dataset_names"),
    )
    split: Word | None = request_field(
        None, help="List only models that were judged on this split."
    )
    every: bool = request_field(
        False, help="List older versions, too.", presentation=Presentation(option="all")
    )
    promotions: bool = request_field(
        False,
        help="List promotions and refusals with the person, the time and the reason.",
    )


@dataclass(frozen=True)
class Promotions(Rows):
    """Decisions on promotions, the newest first."""

    def shortened(self, row: Mapping[str, Any]) -> dict[str, Any]:
        """A decision as a line of a table."""
        columns = (
            "when", "who", "candidate", "champion", "promoted", "forced", "judged_on",
            "judged_against", "pulses", "reason",
        )  # fmt: skip
        return {name: row[name] for name in columns} | {"when": f"{row['when']:%Y-%m-%d %H:%M}"}

    def to_network_json(self) -> list[dict[str, Any]]:
        """Times as text."""
        return [
            {**row, "when": row["when"].isoformat(timespec="seconds")} for row in self.to_json()
        ]


@dataclass(frozen=True, eq=False)
class RegisteredModels(Rows):
    """Versions with the floors of their datasets and what is wrong with them: `rows` has one for
    each version, with its metrics as columns. `listed` are those of `versions` that are shown."""

    versions: Sequence[Version] = ()
    listed: Sequence[Version] = ()
    floors: Mapping[tuple[str, int], Mapping[str, str]] = field(default_factory=dict)
    damages: Mapping[str, str] = field(default_factory=dict)
    withdrawn_pulses: Mapping[str, int] = field(default_factory=dict)
    remarks: Sequence[str] = ()
    every: bool = False

    grouped: ClassVar[bool] = True

    def notes(self) -> Sequence[str]:
        """What is lost, not usable, damaged, or was trained on pulses that are gone."""
        return self.remarks

    def tables(self) -> Sequence[ResultTable]:
        """The models of each dataset with the splits beside each other; all versions, too."""
        from ....training.registry.listing import row_of
        from .tables import table_of

        if not self.versions:
            return (ResultTable("", (), self.empty),)
        tables = []
        for (dataset_hash, seed), floors in self.floors.items():
            trained = [v for v in self.versions if (v.dataset.hash, v.seed) == (dataset_hash, seed)]
            title = f"{trained[0].dataset.name} ({dataset_hash[:12]}), seed {seed}"
            tables.append(ResultTable(title, table_of(trained, floors)))
        if self.every:
            names = ("model", "version", "split", "dataset", "seed", "seconds", "registered_at")
            rows = [{name: row_of(version)[name] for name in names} for version in self.versions]
            tables.append(ResultTable("All versions", rows))
        return tables

    def to_json(self) -> list[dict[str, Any]]:
        """All metrics with intervals, floors and the thesis's figures."""
        from .tables import json_row

        rows = []
        for version in self.listed:
            row = json_row(version, self.floors[version.dataset.hash, version.seed])
            if version.run_id in self.damages:
                row["damaged"] = self.damages[version.run_id]
            if version.dataset.hash in self.withdrawn_pulses:
                row["withdrawn_pulses"] = self.withdrawn_pulses[version.dataset.hash]
            rows.append(row)
        return rows

    def to_network_json(self) -> list[dict[str, Any]]:
        """Rows as pages have them (`figures.version_row`)."""
        from .figures import version_row

        return [
            version_row(version, self.floors[version.dataset.hash, version.seed])
            | {"damaged": self.damages.get(version.run_id)}
            for version in self.listed
        ]


def _list(
    request: ModelList, laboratory: Laboratory, progress: Progress
) -> RegisteredModels | Promotions:
    from ...common.model_registry import models_extra, registry_at, withdrawals_at, withdrawn_words

    if request.promotions:
        return _promotions(request, laboratory, progress)
    with models_extra():
        from ....training.registry.intact_models import damages
        from ....training.registry.listing import flat_row, newest, of_dataset
        from ....training.registry.usability import usability
        from ...common.registered_models import lost_at
        from .tables import floors_by_ground

        registry = registry_at(laboratory.db)
        if registry is None:
            return RegisteredModels((), _NO_MODELS)
        versions = registry.versions()
        if request.dataset is not None:
            versions = of_dataset(versions, request.dataset)
        versions = [version for version in versions if request.split in (None, version.split)]
        listed = versions if request.every else newest(versions)
        floors = floors_by_ground(registry, versions)
        wrong = damages(registry, listed)
        lost = lost_at(laboratory.db, registry)
    withdrawn = withdrawals_at(laboratory.db) if listed else {}
    unusable = (usability([v], floors[v.dataset.hash, v.seed]) for v in listed)
    damaged = (f"{v.label} is damaged: {wrong[v.run_id]}" for v in listed if v.run_id in wrong)
    remarks = (lost, *unusable, *damaged, *withdrawn_words(withdrawn, listed))
    return RegisteredModels(
        [flat_row(version) for version in listed],
        _NO_MODELS,
        versions,
        listed,
        floors,
        wrong,
        {dataset_hash: withdrawal.lost for dataset_hash, withdrawal in withdrawn.items()},
        tuple(filter(None, remarks)),
        request.every,
    )


def _promotions(_: Request, laboratory: Laboratory, __: Progress) -> Promotions:
    from ...common.model_registry import models_extra, registry_at

    with models_extra():
        registry = registry_at(laboratory.db)
        decisions = [] if registry is None else registry.decisions()
    return Promotions(
        [asdict(decision) for decision in decisions],
        "nothing was promoted yet: pyroshock promote MODEL@VERSION",
    )


MODEL_LIST: Operation[ModelList, Any] = Operation(
    name="model-list",
    request=ModelList,
    run=_list,
    help="""List the registered models, the best first, with their figures on both splits.

The list names the floor that repetitions set, and the figures of the thesis. `pyroshock models
MODEL@VERSION` shows one version with its figures and the settings of its training, and which of
them a search chose.

A star marks the model in use. Errors are shares, as means over held-out pulses; --json gives all
metrics with intervals. With --csv, --sort or --columns there is one row for each version, with its
metrics as columns.""",
    example="pyroshock models --dataset rehearsal-pulses\n"
    "pyroshock models gp@1\n"
    "pyroshock models --sort force_nrmse --columns model,version,split,force_nrmse\n"
    "pyroshock models --promotions",
    command=("models", "list"),
    route=("GET", "/models"),
    listing=True,
    needs_store=False,
    absent=_ON_ITS_PAGE,
)


PROMOTION_LIST: Operation[Request, Promotions] = Operation(
    name="promotion-list",
    request=Request,
    run=_promotions,
    help="Promotions and refusals, with the person, the time and the reason.",
    route=("GET", "/models/promotions"),
    listing=True,
    needs_store=False,
    absent={"command": "`models list --promotions` lists them.", **_ON_ITS_PAGE},
)


@dataclass(frozen=True)
class HeldOutPulses(Result):
    """Predicted beside measured on held-out pulses (`figures.held_out_figures`)."""

    figures_of_pulses: Mapping[str, Any]

    def to_json(self) -> dict[str, Any]:
        """The same as plain data."""
        return dict(self.figures_of_pulses)


def _held_out(request: NamedVersion, laboratory: Laboratory, _: Progress) -> HeldOutPulses:
    from ...common.model_registry import models_extra, needed, reader_of

    with models_extra():
        from ....training.registry.listing import chosen
        from .figures import held_out_figures

        registry = needed(laboratory.db)
        version = chosen(registry.versions(), request.label)
        return HeldOutPulses(held_out_figures(registry, version, reader_of(laboratory.store)))


MODEL_HELD_OUT: Operation[NamedVersion, HeldOutPulses] = Operation(
    name="model-held-out",
    request=NamedVersion,
    run=_held_out,
    help="Predicted beside measured on the held-out pulses of a version, and how often its "
    "intervals hold.",
    route=("GET", "/models/{model}/{version}"),
    absent={"command": "`report MODEL@VERSION` draws the held-out pulses.", **_ON_ITS_PAGE},
)
