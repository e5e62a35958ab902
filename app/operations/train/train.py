"""Training models on a dataset: each is registered as it is finished, under the key of its task,
and found by it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from pydantic import ValidationInfo, field_validator

from ....schema.person_roles import ENGINEER
from ..faults import about
from ..fields import Names, Presentation, Seed, request_field, source_of
from ..laboratory import Laboratory
from ..operation import FormPage, Operation, Progress, Request

if TYPE_CHECKING:
    from ....schema.session import Store
    from ....training.registry.registry import Registry
    from .service import TrainingRuns


class Training(Request):
    """Models to train on the splits of a dataset."""

    dataset: str = request_field(
        min_length=1,
        max_length=1000,
        help="Name the dataset to train on.",
        presentation=Presentation(positional=True, metavar="DATASET", completion="dataset_names"),
    )
    models: Names = request_field(
        ("usual",),
        validate_default=True,
        help="Train these models. Repeat the option, or give a list: a,b. [default: usual, which "
        "is linear, tree, gp, coregional-gp and nn-ga]",
        presentation=Presentation(metavar="A,B|usual|all"),
    )
    split: Names = request_field(
        (),
        help="Choose what is held out: repetitions, configurations, treatments, materials, "
        "campaigns, material=NAME or campaign=NAME. Held-out repetitions flatter a model; read "
        "them beside held-out configurations. Repeat the option, or give a list: s,t. [default: "
        "repetitions and configurations, as far as the dataset can be split so]",
        presentation=Presentation(metavar="S,T"),
    )
    seed: Seed = request_field(0, help="Set the seed: the same seed gives the same models.")
    budget: Literal["small", "reduced", "full"] | None = request_field(
        None,
        help="Choose the size of the genetic search of settings. [default: small for the usual "
        "models, reduced for others]",
    )
    retrain: bool = request_field(False, help="Train again what is already registered.")

    @field_validator("models")
    @classmethod
    def _are_known(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        from ...common.model_registry import models_extra

        if not names:
            raise ValueError("models is empty; expected at least one model, usual or all")
        with models_extra():
            from ....training.models.catalogue import models_of

            return tuple(models_of(",".join(names)))

    @field_validator("retrain")
    @classmethod
    def _is_no_job(cls, retrain: bool, info: ValidationInfo) -> bool:
        if retrain and source_of(info) in ("network", "stored"):
            raise ValueError(
                "retrain is True; expected false, because a job that is begun again must find what "
                "it has trained: use the command line"
            )
        return retrain


def check(request: Training, laboratory: Laboratory) -> None:
    """Raises `LookupError` for an unknown dataset, `ValueError` for a split that it does not
    allow."""
    _splits(request, laboratory.store)


def _splits(request: Training, store: Store) -> list[str]:
    from ....dataset.snapshot import read_snapshot
    from ...common.model_registry import splits_of, usual_splits

    with about("dataset"):
        table = read_snapshot(store, request.dataset).table
    with about("split"):
        return splits_of(table, ",".join(request.split) or usual_splits(table))


def _run(request: Training, laboratory: Laboratory, progress: Progress) -> TrainingRuns:
    from ...common.model_registry import context_of, models_extra, registry_of
    from ...common.registered_models import note_registered

    with models_extra():
        from ....training.fitting import session as training_session
        from ....training.models.catalogue import USUAL_MODELS
        from .registered_figures import RegisteredFigures
        from .service import TrainingRuns

        db, store = laboratory.db, laboratory.store
        registry = registry_of(db) if request.retrain else fenced_registry(db, store)
        usual = set(request.models) == set(USUAL_MODELS)
        budget = request.budget or ("small" if usual else "reduced")
        context = context_of(
            *(store, request.dataset, registry, request.seed, budget), RegisteredFigures()
        )
        splits = _splits(request, store)
        remarks: list[str] = []
        session = training_session.train(
            registry,
            context,
            request.models,
            splits,
            retrain=request.retrain,
            executor=laboratory.executor,
            progress=training_session.Progress(progress, remarks.append),
        )
        note_registered(store, registry)
        floors = registry.floors(context.dataset.hash, request.seed)
    failures = {
        f"{failure.model} ({failure.split})": failure.reason for failure in session.failures
    }
    if failures and not session.versions:
        words = "; ".join(f"{model}: {reason}" for model, reason in failures.items())
        raise ValueError(f"no model was trained: {words}")
    return TrainingRuns(tuple(session.versions), failures, session.trained, floors, tuple(remarks))


def fenced_registry(db: str, store: Store) -> Registry:
    """The registry of a store. It records a model only while the store may be written, and one that
    was registered meanwhile is not registered again.

    MLflow's store is another one than ours, so that both cannot be written in one transaction. What
    is left is a worker that sleeps for the whole lease of its job within these lines, without the
    lock of its dataset (another machine): a version more, with the same model in it.
    """
    from ....training.registry.connection import user_environment
    from ....training.registry.model_storage import storage_for
    from ....training.registry.records import Trained, Version
    from ....training.registry.registry import Registry

    class FencedRegistry(Registry):
        def record(self, trained: Trained, session: str | None = None) -> Version:
            with store.writing():  # raises where the lease of a job is lost
                pass
            registered = (v for v in self.versions() if v.task_key == trained.task.key)
            return next(registered, None) or super().record(trained, session)

    return FencedRegistry(storage_for(db, user_environment()))


TRAIN: Operation[Training, TrainingRuns] = Operation(
    name="train",
    role=ENGINEER,
    request=Training,
    run=_run,
    check=check,
    help="""Train models on DATASET and register them; each is judged on pulses that it has not
    seen.

    A model that is registered already is not trained again, so that an interrupted training
    continues when it is started again.""",
    example="""pyroshock train rehearsal-pulses --models linear,hann
pyroshock train rehearsal-pulses --models linear --split material=steel""",
    route=("POST", "/train"),
    long=True,
    steps="%",
    workers="Set the number of processes that train.",
    label=lambda request: str(request.dataset),
    form=FormPage("/models/train", "train", "/models/train", required=("models",)),
)
