"""Comparing versions of models on the held-out pulses that they have in common."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from ....schema.person_roles import READER
from ....training.evaluation.metrics import METRICS
from ..fields import Names, Presentation, request_field
from ..laboratory import Laboratory
from ..operation import Operation, Output, Progress, Request, Result
from .service import ModelComparison

#: Versions that a comparison takes at most.
MOST_COMPARED = 20


class Comparing(Request):
    """Versions to compare, or what to choose them by."""

    version: Annotated[Names, Field(max_length=MOST_COMPARED)] = request_field(
        (),
        help="Name the versions, as MODEL or MODEL@VERSION; without any, the newest of every model "
        "of the split is compared.",
        presentation=Presentation(
            positional=True, metavar="[MODEL[@VERSION]]...", completion="model_versions"
        ),
    )
    dataset: str | None = request_field(
        None,
        max_length=1000,
        help="Compare models of this dataset. [default: the newest that was trained on]",
        presentation=Presentation(metavar="NAME", completion="dataset_names"),
    )
    split: str | None = request_field(
        None,
        max_length=1000,
        help="Choose the split that the models were judged on. [default: the first that all have "
        "in common; without names repetitions, or that of the newest model where none was judged "
        "on repetitions]",
    )
    metric: Literal[(*METRICS, "all")] = request_field(  # type: ignore[valid-type]
        "force_nrmse",
        help="Compare by this measure, or by all eight.",
        presentation=Presentation(metavar="M|all"),
    )

    @model_validator(mode="before")
    @classmethod
    def _with_their_split(cls, values: Any) -> Any:
        """A row of a list of models names its split, too: "svr@1 configurations"."""
        if not isinstance(values, Mapping):
            return values
        given = values.get("version") or ()
        rows = [str(row) for row in ([given] if isinstance(given, str) else given)]
        splits = {split for row in rows if (split := row.strip().partition(" ")[2].strip())}
        if not splits:
            return values
        if values.get("split"):
            splits.add(str(values["split"]))
        if len(splits) > 1:
            raise ValueError(
                f"versions of several splits are chosen ({', '.join(sorted(splits))}); choose "
                "versions of one split"
            )
        labels = [row.strip().partition(" ")[0] for row in rows]
        return {**values, "version": labels, "split": splits.pop()}


def _run(request: Comparing, laboratory: Laboratory, _: Progress) -> ModelComparison:
    from ....dataset.catalog import list_withdrawals
    from ...common.model_registry import models_extra, needed, reader_of, withdrawn_words

    store = laboratory.store
    metric = METRICS[0] if request.metric == "all" else request.metric
    remarks: list[str] = []
    with models_extra():
        from .comparing import MOST_EACH_WITH_EACH, comparisons_of, served, versions_named

        registry = needed(laboratory.db)
        named = versions_named(registry.versions(), request.version, request.dataset, request.split)
        versions = served(registry, named, request.version, remarks.append)
        remarks += withdrawn_words(store.read(list_withdrawals), versions)
        comparisons = comparisons_of(
            registry,
            versions,
            metric,
            each_with_each=bool(request.version) and len(versions) <= MOST_EACH_WITH_EACH,
            read=reader_of(store),
        )
    return ModelComparison(comparisons, request.metric, tuple(remarks))


COMPARE: Operation[Comparing, ModelComparison] = Operation(
    name="compare",
    role=READER,
    request=Comparing,
    run=_run,
    help="""Compare models on the held-out pulses that they have in common: which is better, where,
    and whether beyond chance.

    Each model is compared with each other one; of more than eight, and without a name, the best is
    compared with all others. Intervals are 90 %, by configuration. The settings of each training
    are listed side by side.""",
    example="""pyroshock train rehearsal-pulses --models linear --split configurations
pyroshock compare gp@1 linear@1 --metric cost --plot difference.png""",
    route=("GET", "/models/compare"),
    label=lambda request: ", ".join(request.version),
    outputs=(
        Output(
            "plot", "Draw the first comparison into FILE.png.", Result.write_figure, older="out"
        ),
    ),
    absent={"form": "its page is an address that can be sent on: /models/compare?version=A"},
)
