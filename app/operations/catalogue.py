"""Every operation: its name, where it is declared, and the words of its commands.

A new operation is a file of its feature below `app/operations`, and a row here. The table keeps
help and completion from importing the operations. `pyroshock serve` and `pyroshock demo` are plain
commands beside it: they start a program, which asks for operations.
"""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .operation import Operation

#: Name -> (module below this package, or beside it after a point; attribute; and the words of its
#: commands). The words stand here and not with the operations, so that a command imports its own
#: operation alone.
OPERATIONS: dict[str, tuple[str, ...]] = {
    "init": ("store.upkeep", "INIT", "init"),
    "db-upgrade": ("store.upkeep", "UPGRADE", "db upgrade"),
    "db-roles": ("store.upkeep", "ROLES", "db roles"),
    "db-copy": ("store.upkeep", "COPY", "db copy"),
    "db-export": ("store.upkeep", "EXPORT", "db export"),
    "db-import": ("store.upkeep", "IMPORT", "db import"),
    "db-backup": ("store.upkeep", "BACKUP", "db backup"),
    "db-restore": ("store.upkeep", "RESTORE", "db restore"),
    "db-check": ("store.integrity", "DB_CHECK", "db check"),
    "query": ("store.question", "QUERY", "query"),
    "search": ("store.search", "SEARCH", "search"),
    "material-list": ("store.materials", "MATERIAL_LIST", "materials list"),
    "material-add": ("store.materials", "MATERIAL_ADD", "materials add"),
    "home-pictures": ("home.pictures", "HOME_PICTURES", "home list"),
    "home-arrange": ("home.pictures", "HOME_ARRANGE", "home arrange"),
    "user-list": ("people.users", "USER_LIST", "users list"),
    "user-add": ("people.users", "USER_ADD", "users add"),
    "user-invite": ("people.users", "USER_INVITE", "users invite"),
    "user-change": ("people.users", "USER_CHANGE", "users change"),
    "user-password": ("people.users", "USER_PASSWORD", "users password"),
    "user-remove": ("people.users", "USER_REMOVE", "users remove"),
    "own-password": ("people.account", "OWN_PASSWORD"),
    "token-list": ("people.account", "TOKEN_LIST"),
    "token-add": ("people.account", "TOKEN_ADD"),
    "token-revoke": ("people.account", "TOKEN_REVOKE"),
    "note-list": ("people.notes", "NOTE_LIST", "notes list"),
    "note-add": ("people.notes", "NOTE_ADD", "notes add"),
    "note-edit": ("people.notes", "NOTE_EDIT", "notes edit"),
    "note-withdraw": ("people.notes", "NOTE_WITHDRAW", "notes withdraw"),
    "tag-list": ("people.tags", "TAG_LIST", "tags list"),
    "tag-add": ("people.tags", "TAG_ADD", "tags add"),
    "tag-remove": ("people.tags", "TAG_REMOVE", "tags remove"),
    "attachment-list": ("people.attachments", "ATTACHMENT_LIST", "attachments list"),
    "attachment-add": ("people.attachments", "ATTACHMENT_ADD", "attachments add"),
    "attachment-get": ("people.attachments", "ATTACHMENT_GET", "attachments get"),
    "attachment-remove": ("people.attachments", "ATTACHMENT_REMOVE", "attachments remove"),
    "attachment-restore": ("people.attachments", "ATTACHMENT_RESTORE", "attachments restore"),
    "filter-list": ("people.saved_filters", "FILTER_LIST", "filters list"),
    "filter-save": ("people.saved_filters", "FILTER_SAVE", "filters save"),
    "filter-delete": ("people.saved_filters", "FILTER_DELETE", "filters delete"),
    "audit-list": ("people.audit_trail", "AUDIT_LIST", "audit"),
    "plugins": ("store.plugins", "PLUGINS", "plugins"),
    "job-list": (".jobs.job_operations", "JOB_LIST", "jobs list"),
    "job-show": (".jobs.job_operations", "JOB_SHOW", "jobs show"),
    "job-stop": (".jobs.job_operations", "JOB_STOP", "jobs stop"),
    "job-delete": (".jobs.job_operations", "JOB_DELETE", "jobs delete"),
    "work": (".jobs.work", "WORK", "work"),
    "plan": ("plan.make", "PLAN", "plan"),
    "plan-list": ("plan.status", "PLAN_LIST", "plan list", "plans list"),
    "plan-status": ("plan.status", "PLAN_STATUS", "plan status", "plans show"),
    "plan-quality": ("plan.judge", "PLAN_QUALITY", "plan quality"),
    "plan-sheet": ("plan.sheet", "PLAN_SHEET", "plan sheet"),
    "plan-decide": ("plan.runs", "PLAN_DECIDE", "plan decide"),
    "plan-discard": ("plan.runs", "PLAN_DISCARD", "plan discard"),
    "plan-augment": ("plan.runs", "PLAN_AUGMENT", "plan augment"),
    "plan-predict": ("shot_predictions.predict_runs", "PLAN_PREDICT", "plan predict"),
    "plan-predictions": (
        "shot_predictions.predicted_runs",
        "PLAN_PREDICTIONS",
        "plan predictions",
    ),
    "plan-delete": ("plan.status", "PLAN_DELETE", "plans delete"),
    "simulate": ("plan.simulate", "SIMULATE", "simulate"),
    "ingest": ("ingest.folder", "INGEST", "ingest"),
    "check": ("ingest.folder", "CHECK"),
    "extract": ("ingest.extract", "EXTRACT", "extract"),
    "campaign-list": ("ingest.campaigns", "CAMPAIGN_LIST", "campaigns list"),
    "campaign-page": ("ingest.campaigns", "CAMPAIGN_PAGE"),
    "campaign-show": ("ingest.campaigns", "CAMPAIGN_SHOW", "campaigns show"),
    "campaign-init": ("ingest.campaigns", "CAMPAIGN_INIT", "campaigns init"),
    "describe": ("ingest.describe", "DESCRIBE", "campaigns describe"),
    "campaign-correct": ("ingest.correct", "CAMPAIGN_CORRECT", "campaigns correct"),
    "campaign-delete": ("ingest.campaigns", "CAMPAIGN_DELETE", "campaigns delete"),
    "archive": ("ingest.campaigns", "ARCHIVE", "campaigns archive"),
    "restore": ("ingest.campaigns", "RESTORE", "campaigns restore"),
    "deleted-list": ("ingest.campaigns", "DELETED_LIST", "campaigns deleted"),
    "run-list": ("ingest.runs", "RUN_LIST", "runs list"),
    "run-show": ("ingest.runs", "RUN_SHOW", "runs show"),
    "run-discard": ("ingest.runs", "RUN_DISCARD", "runs discard", "runs delete"),
    "run-restore": ("ingest.runs", "RUN_RESTORE", "runs restore"),
    "run-replace": ("ingest.runs", "RUN_REPLACE", "runs replace"),
    "standing": ("ingest.runs", "STANDING"),
    "impact-list": ("impacts.listing", "IMPACT_LIST", "impacts list"),
    "impact-show": ("impacts.showing", "IMPACT_SHOW", "show", "impacts show"),
    "impact-delete": ("impacts.removal", "IMPACT_DELETE", "impacts delete"),
    "impact-preview": ("impacts.extraction", "IMPACT_PREVIEW", "impacts preview"),
    "impact-extract": ("impacts.extraction", "IMPACT_EXTRACT", "impacts extract"),
    "channel-window": ("impacts.showing", "CHANNEL_WINDOW"),
    "shot-list": ("impacts.listing", "SHOT_LIST", "shots"),
    "srs": ("impacts.recording_spectrum", "SRS", "srs"),
    "series-spectrum": ("impacts.recording_spectrum", "SERIES_SPECTRUM"),
    "spectra": ("impacts.compared_spectra", "COMPARE_SPECTRA", "impacts spectra"),
    "explore": ("explore.explore", "EXPLORE", "explore"),
    "view-list": ("explore.views", "VIEW_LIST", "views list"),
    "view-show": ("explore.views", "VIEW_SHOW", "views show"),
    "view-save": ("explore.views", "VIEW_SAVE", "views save"),
    "view-rename": ("explore.views", "VIEW_RENAME", "views rename"),
    "view-delete": ("explore.views", "VIEW_DELETE", "views delete"),
    "view-restore": ("explore.views", "VIEW_RESTORE", "views restore"),
    "export": ("impacts.table_export", "EXPORT", "export"),
    "calibrate": ("ingest.calibrate", "CALIBRATE", "calibrate"),
    "tune": ("tune.tuning", "TUNE", "tune"),
    "validate": ("validate.validating", "VALIDATE", "validate"),
    "predict": ("predict.predict", "PREDICT", "predict"),
    "twin": ("predict.predict", "TWIN"),
    "train": ("train.train", "TRAIN", "train"),
    "compare": ("train.compare", "COMPARE", "compare"),
    "promote": ("train.promote", "PROMOTE", "promote"),
    "model-list": ("train.listed_models", "MODEL_LIST", "models list"),
    "promotion-list": ("train.listed_models", "PROMOTION_LIST"),
    "model-held-out": ("train.listed_models", "MODEL_HELD_OUT"),
    "model-show": ("train.stored_models", "MODEL_SHOW", "models show"),
    "learning-curve": ("train.learning_curve", "LEARNING_CURVE", "models learning-curve"),
    "model-delete": ("train.stored_models", "MODEL_DELETE", "models delete"),
    "model-recover": ("train.stored_models", "MODEL_RECOVER", "models recover"),
    "dataset-build": ("train.build_dataset", "DATASET_BUILD", "dataset build"),
    "dataset-list": ("train.stored_datasets", "DATASET_LIST", "dataset list", "datasets list"),
    "dataset-show": ("train.stored_datasets", "DATASET_SHOW", "dataset show", "datasets show"),
    "dataset-trace": ("train.stored_datasets", "DATASET_TRACE", "dataset trace"),
    "dataset-export": ("train.stored_datasets", "DATASET_EXPORT", "dataset export"),
    "dataset-delete": (
        "train.stored_datasets",
        "DATASET_DELETE",
        "dataset delete",
        "datasets delete",
    ),
    "diagnose": ("diagnose.make", "DIAGNOSE", "diagnose"),
    "plan-next-runs": ("diagnose.plan_next_runs", "DISCRIMINATE", "plan discriminate"),
    "adopt": ("diagnose.adopt", "ADOPT", "diagnoses adopt"),
    "list-diagnoses": ("diagnose.show", "LIST_DIAGNOSES", "diagnoses list"),
    "show-diagnosis": ("diagnose.show", "SHOW_DIAGNOSIS", "diagnoses show"),
    "delete-diagnosis": ("diagnose.delete", "DELETE_DIAGNOSIS", "diagnoses delete"),
    "report": ("report.report", "REPORT", "report"),
    "blind-check": ("diagnose.blind_check", "BLIND_CHECK", "blind-check"),
}

#: Folder of a feature -> the topic below which the description of the API has its routes; a folder
#: that is not here is a topic of its own name.
TOPICS = {
    "plan": "plans",
    "shot_predictions": "plans",
    "tune": "twin",
    "validate": "twin",
    "predict": "twin",
    "train": "models",
    "diagnose": "diagnoses",
    "ingest": "campaigns",
}


def operation(name: str) -> Operation[Any, Any]:
    """The operation of a name. Raises `LookupError` for one that there is not."""
    if name not in OPERATIONS:
        raise LookupError(f"no operation {name!r}; there are: {', '.join(OPERATIONS)}")
    module, attribute, *_ = OPERATIONS[name]
    declared: Operation[Any, Any] = getattr(
        importlib.import_module(f".{module}", __package__), attribute
    )
    return declared


def topic_of(name: str) -> str:
    """The topic of an operation's route in the description of the API."""
    feature = OPERATIONS[name][0].removeprefix(".").partition(".")[0]
    return TOPICS.get(feature, feature)


def commands_of_noun(noun: str) -> dict[str, str]:
    """The word behind a noun -> the operation; "" of one whose words are the noun alone."""
    return {
        " ".join(words.split()[1:]): name
        for name, (_, _, *commands) in OPERATIONS.items()
        for words in commands
        if words.split()[0] == noun
    }


def operations() -> Iterator[Operation[Any, Any]]:
    """All operations, in the order of the table."""
    return map(operation, OPERATIONS)
