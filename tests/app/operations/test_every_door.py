"""Every operation through every door: the same request gives the same answer and the same refusal.

An operation that lacks a door says why. The values that are refused follow from the bounds of the
fields, so that a new operation is tested as soon as it has a row in `EXAMPLES`.
"""

from __future__ import annotations

import inspect
import json
import math
import shutil
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

import click
import pytest
from pydantic.fields import FieldInfo
from pyroshock.app.common.errors import InvalidValueError
from pyroshock.app.common.number_format import finite
from pyroshock.app.doors.command_line.main import OTHERS, main
from pyroshock.app.doors.command_line.operation_command import OperationCommand, option_of
from pyroshock.app.doors.python import PythonMethod
from pyroshock.app.jobs.known_kinds import KINDS
from pyroshock.app.jobs.queue import ask as ask_job
from pyroshock.app.library.experiment_store import ExperimentStore
from pyroshock.app.library.plans import PlanCollection
from pyroshock.app.library.server_answers import ServerAnswers
from pyroshock.app.operations.catalogue import OPERATIONS, operation, operations
from pyroshock.app.operations.diagnose import diagnosing
from pyroshock.app.operations.faults import argument_of, bare, bounds, read
from pyroshock.app.operations.fields import RecordedFile, TextFile, presentation_of
from pyroshock.app.operations.form import form_page, text_of
from pyroshock.app.operations.laboratory import Laboratory
from pyroshock.app.operations.operation import DOORS, Operation, Request
from pyroshock.app.twins import building
from pyroshock.diagnosis.verdict import NextRun
from pyroshock.schema.audit import AuditRow
from pyroshock.schema.session import Store
from pyroshock.training.registry.model_storage import storage_for
from pyroshock.training.registry.registry import Registry
from pyroshock.validation import blind_check
from sqlalchemy import select
from starlette.testclient import TestClient
from support.checks.same_results import assert_same_result, sent
from support.processes.web_client import TestConnection, ended, post, post_json, window
from support.records import verdicts
from support.records.campaigns import hammer_campaign, recording_name
from support.records.twin_parts import unsolved
from support.stores.campaign_counts import assert_counts_kept
from support.stores.registries import at_its_place
from support.stores.stores import opened, pyroshock, run_pyroshock
from support.stores.web_stores import DATASET, HAMMER, filled_lab

__all__ = ["filled_lab"]

#: A half sine, as CSV.
RECORD = "time_s,acc\n" + "".join(
    f"{sample / 10_000:g},{100 * max(math.sin(sample / 20), 0) * (sample < 200):g}\n"
    for sample in range(400)
)
_SPRING = {"name": "spring", "method": "sobol", "runs": 4, "seed": 3, "repetitions": 2}
_FORCE = {"name": "force", "kind": "distribution", "x": "peak_force_n"}
PASSWORD = "four quiet grey herons"
#: A request that can be answered, of each operation. {folder} is a new one for each door.
EXAMPLES: dict[str, dict[str, Any]] = {
    "init": {},
    "db-upgrade": {},
    "db-copy": {"source": "{store}", "target": "{store}.copy"},
    "db-export": {"campaign": "shelf", "out": "{folder}"},
    "db-import": {"file": "{store}"},
    "db-backup": {"folder": "{folder}"},
    "db-check": {"campaign": "shelf", "repair": "{campaign}"},
    "query": {"statement": "select name, density_kg_m3 from materials", "limit": 2},
    "search": {"words": "steel"},
    "material-list": {},
    "material-add": {
        "name": "titanium",
        "youngs_modulus": "114GPa",
        "poisson_ratio": 0.34,
        "density": "4430kg/m3",
        "yield_strength": "880MPa",
        "source": "data sheet 12-7",
    },
    "user-list": {},
    "user-add": {"name": "anna", "role": "operator", "password": PASSWORD},
    "user-invite": {"name": "anna", "login": "anna@lab.example"},
    "user-change": {"name": "anna", "role": "engineer"},
    "user-password": {"name": "anna", "password": "five other grey herons"},
    "user-remove": {"name": "anna"},
    "note-list": {"about": "campaign", "subject": "shelf"},
    "note-add": {"about": "campaign", "subject": "shelf", "text": "the plate was loose"},
    "note-withdraw": {"note": 1, "reason": "it was another plate"},
    "tag-list": {"tag": "doubtful"},
    "tag-add": {"about": "impact", "subject": "shelf/1/1", "tag": "doubtful"},
    "tag-remove": {"about": "impact", "subject": "1", "tag": "doubtful"},
    "attachment-list": {"campaign": "shelf"},
    "attachment-get": {"attachment": 1},
    "attachment-remove": {"attachment": 1, "reason": "it was another plate"},
    "attachment-restore": {"attachment": 1},
    "filter-list": {},
    "filter-save": {"name": "doubtful", "address": "/impacts?where=tag=doubtful"},
    "filter-delete": {"name": "doubtful"},
    "audit-list": {"operation": "material-add", "limit": 5},
    "plugins": {},
    "job-list": {"limit": 5},
    "job-show": {"job": 1},
    "job-stop": {"job": 1},
    "job-delete": {"job": 1},
    "work": {"once": True},
    "plan": _SPRING,
    "plan-list": {},
    "plan-status": {"name": "spring"},
    "plan-quality": {"name": "spring", "effect": 1.5},
    "plan-sheet": {"name": "spring"},
    "plan-decide": {"name": "spring", "run": 2, "status": "discarded", "note": "tip broke"},
    "plan-discard": {"name": "spring", "run": 3, "reason": "tip broke"},
    "plan-augment": {"name": "spring", "runs": 2, "repetitions": 1, "seed": 5},
    "plan-predict": {"name": "spring", "runs": "1-2", "contact": "hertz", "draws": 20},
    "plan-predictions": {"name": "spring"},
    "plan-delete": {"name": "spring"},
    "simulate": {"plan": "spring", "out": "{folder}", "repetitions": 1},
    "train": {"dataset": DATASET, "models": ("linear", "tree"), "split": ("repetitions",)},
    "compare": {"version": ("linear@1", "tree@1"), "metric": "cost"},
    "promote": {"model": "tree", "version": 1, "force": True, "reason": "a start"},
    "model-list": {"dataset": DATASET, "every": True},
    "promotion-list": {},
    "model-held-out": {"model": "linear", "version": 1},
    "model-show": {"model": "linear@1"},
    "learning-curve": {"model": "linear", "version": 1, "seed": 2},
    "model-delete": {"model": "linear", "version": 1},
    "model-recover": {},
    "dataset-build": {"name": "both", "campaigns": (HAMMER,), "velocity": "integrated"},
    "dataset-list": {},
    "dataset-show": {"name": DATASET, "seed": 2},
    "dataset-trace": {"name": DATASET},
    "dataset-export": {"name": DATASET},
    "dataset-delete": {"name": "spare"},
    "predict": {
        "impact_velocity_m_s": "8m/s",
        "contact": "hertz",
        "effects": ("plate.damping:factor=2.0",),
        "draws": 4,
        "frequencies": "200:800:3",
    },
    "twin": {"contact": "hertz"},
    "report": {"subject": HAMMER},
    "diagnose": {"campaign": "spring", "seed": 1, "with_effects": ["gun.valve_flow"]},
    "plan-next-runs": {"diagnosis": 1, "name": "apart"},
    "adopt": {"diagnosis": 1, "effect": "contact.layer_compliance"},
    "list-diagnoses": {"campaign": "spring"},
    "show-diagnosis": {"diagnosis": 1},
    "delete-diagnosis": {"diagnosis": 1},
    "blind-check": {"cases": 1, "tiers": ["weak"], "split": "development"},
    "ingest": {"path": "{campaign}", "threshold": 0.02, "again": (recording_name(1),)},
    "extract": {"campaign": "shelf", "segmentation": "mask", "smoothing": 0.98},
    "campaign-list": {},
    "campaign-show": {"campaign": "shelf"},
    "campaign-init": {"folder": "{folder}", "kind": "gun", "plan": "spring"},
    "campaign-delete": {"campaign": "shelf", "reason": "wrong sensor", "dry_run": True},
    "campaign-correct": {
        "campaign": "shelf",
        "facts": {"tip_radius_mm": "31", "bench.hammer.mass_kg": "0.33"},
        "run": (1,),
        "reason": "measured anew",
    },
    "run-restore": {"campaign": "shelf", "recording": recording_name(2)},
    "deleted-list": {"campaign": "shelf"},
    "run-list": {"campaign": "shelf"},
    "run-show": {"campaign": "shelf", "recording": recording_name(1)},
    "run-discard": {"campaign": "shelf", "recording": recording_name(2), "reason": "loose plate"},
    "explore": {"kind": "control", "y": "peak_force_n", "colour": "run", "select_y": "0:1e6"},
    "view-list": {},
    "home-pictures": {},
    "home-arrange": {"pictures": ["runs-by-plan", "models-in-use"]},
    "view-show": {"name": "force"},
    "view-save": {"name": "time", "x": "peak_force_n", "y": "contact_time_s", "log_y": True},
    "view-rename": {"name": "force", "new_name": "peaks"},
    "view-delete": {"name": "force"},
    "view-restore": {"name": "gone"},
    "impact-list": {"campaign": "shelf", "where": ("peak_force_n>0",), "limit": 3},
    "impact-show": {"impact": 1},
    "impact-delete": {"impact": 2, "all_of_recording": True, "reason": "loose plate"},
    "impact-preview": {"impact": 1, "threshold": 0.02},
    "impact-extract": {"impact": 1, "threshold": 0.02},
    "channel-window": {"channel": 1, "points": 40},
    "shot-list": {},
    "srs": {"file": RECORD, "unit": "g", "frequencies": "100,500", "full_scale": "500g"},
    "series-spectrum": {
        "acceleration_m_s2": (0.0, 1.0, 0.0, -1.0),
        "sampling_rate_hz": 100.0,
        "frequency_hz": (10.0,),
    },
    "spectra": {"impact": (21,), "q": 25, "reference": 21},
    "calibrate": {
        "file": "reference,reading_v\n0,0.3626\n1,0.9248\n2,1.4862\n3,2.0491\n",
        "date": "2026-03-02",
        "reading_u": "1mV",
        "common_u": "5mbar",
    },
}
#: A text that is attached to the campaign: its table of runs.
_ATTACHED: list[tuple[str, dict[str, Any]]] = [
    ("ingest", {"path": "{campaign}"}),
    ("attachment-add", {"file": "{campaign}/runs.csv", "campaign": "shelf"}),
]
#: What is answered before, so that the store has what the example names.
BEFORE: dict[str, list[tuple[str, dict[str, Any]]]] = {
    **{
        name: [("plan", _SPRING)]
        for name in EXAMPLES
        if name.startswith("plan-") and name != "plan-next-runs"
    },
    "simulate": [("plan", _SPRING)],
    **{name: [("ingest", {"path": "{campaign}"})] for name in ("db-export", "db-check")},
    "job-delete": [("job-stop", {"job": 1})],
    **{
        name: [("user-add", {"name": "anna", "password": PASSWORD})]
        for name in ("user-list", "user-change", "user-password", "user-remove")
    },
    "campaign-init": [("plan", _SPRING)],
    **{
        name: [("ingest", {"path": "{campaign}"})]
        for name in EXAMPLES
        if name.startswith(("extract", "campaign-", "run-", "impact-", "channel-"))
        and name != "campaign-init"
    },
    "run-restore": [
        ("ingest", {"path": "{campaign}"}),
        ("run-discard", {"campaign": "shelf", "recording": recording_name(2), "reason": "loose"}),
    ],
    "deleted-list": [
        ("ingest", {"path": "{campaign}"}),
        ("campaign-delete", {"campaign": "shelf", "reason": "wrong sensor"}),
    ],
    **{
        name: [("ingest", {"path": "{campaign}"}), ("view-save", _FORCE)]
        for name in ("explore", "view-list", "view-show", "view-save", "view-rename", "view-delete")
    },
    "view-restore": [
        ("view-save", {**_FORCE, "name": "gone"}),
        ("view-delete", {"name": "gone"}),
    ],
    **{
        name: [
            ("ingest", {"path": "{campaign}"}),
            ("note-add", {"about": "campaign", "subject": "shelf", "text": "the plate was loose"}),
            ("tag-add", {"about": "impact", "subject": "1", "tag": "doubtful"}),
            ("tag-add", {"about": "campaign", "subject": "shelf", "tag": "doubtful"}),
        ]
        for name in ("note-list", "note-withdraw", "tag-list", "tag-remove")
    },
    **{key: [("ingest", {"path": "{campaign}"})] for key in ("note-add", "tag-add")},
    **dict.fromkeys(("attachment-list", "attachment-get", "attachment-remove"), _ATTACHED),
    "attachment-restore": [*_ATTACHED, ("attachment-remove", {"attachment": 1, "reason": "wrong"})],
    **{
        key: [("filter-save", {"name": "doubtful", "address": "/impacts?where=tag=doubtful"})]
        for key in ("filter-list", "filter-delete")
    },
    "dataset-delete": [
        ("dataset-build", {"name": "spare", "campaigns": (HAMMER,), "velocity": "integrated"})
    ],
}
_OF_MODELS = ("train", "compare", "promot", "model-", "dataset-", "spectra", "report")
#: These find campaigns, a dataset and models in the store.
FILLED = {name for name in EXAMPLES if name.startswith(_OF_MODELS)} | {"learning-curve"}
#: These find a campaign and a diagnosis of it in the store.
DIAGNOSED = {"diagnose", "plan-next-runs", "adopt", "blind-check"} | {
    name for name in EXAMPLES if name.endswith(("-diagnoses", "-diagnosis"))
}
#: Answered with the tests of their own features: they need a gun's campaign and its solved plate.
ANSWERED_ELSEWHERE = {"tune", "validate"}
#: Answered with the tests of pages, files and removal: a single door has them, or a door names a
#: file that the others may not.
ANSWERED_ELSEWHERE |= {
    "export",
    "check",
    "campaign-page",
    "standing",
    "archive",
    "restore",
    "run-replace",
    "describe",
}
#: A file has another name at each door (tests/app/web/test_attachments.py).
ANSWERED_ELSEWHERE |= {"attachment-add"}
#: The roles of a server, and a store that must not be there before.
ANSWERED_ELSEWHERE |= {"db-roles", "db-restore"}
#: These are a signed-in person's own (tests/app/web/test_people.py, test_notes.py).
ANSWERED_ELSEWHERE |= {"own-password", "token-list", "token-add", "token-revoke", "note-edit"}
#: Operations whose example writes a file, or finds nothing to change in the store: they leave no
#: row of the audit trail, unless a job has done them.
CHANGES_NO_ROW = {
    *("db-copy", "db-export", "db-import", "db-backup", "db-check", "simulate", "campaign-init"),
    *("campaign-delete", "blind-check", "init"),
}
#: What an answer says of the moment, and not of what was asked.
_OF_THE_MOMENT = {
    "saved_at",
    "when",
    "who",
    "id",
    "made_at",
    "written_at",
    "author",
    "author_kind",
    "attached_at",
    "removed_at",
    "removed_by",
    "diagnosed_at",
    "deleted_at",
    "asked_at",
    "ended_at",
}
#: What differs between stores that are made one after the other.
_OF_THE_STORE = {"db-copy": {"sha256"}, "db-backup": {"size_bytes"}}
#: A form whose answer is a page has no data to compare; its page has tests of its own.
_SEEN_ON_A_PAGE = object()
NEXT = NextRun("separates A from B", {"tank_pressure_bar": 0.45, "bullet_mass_kg": 0.1428}, 4)


#: Results that hold what a test has made up, which no client knows.
UNSENT = {"blind-check"}


class MadeUpScore:
    """The report of a blind check, which takes minutes."""

    tiers = ()

    def as_json(self) -> dict[str, Any]:
        return {"tiers": [{"tier": "weak", "first": 1.0, "ece": float("nan")}]}


@pytest.fixture(autouse=True)
def made_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """Diagnoses and blind checks are made up, and plates need no solution."""
    answer = verdicts.verdict(campaign="spring", next_runs=(NEXT,))
    monkeypatch.setattr(diagnosing, "run_diagnosis", lambda *_, **__: answer)
    monkeypatch.setattr(blind_check, "run", lambda *_, **__: MadeUpScore())
    monkeypatch.setattr(building, "solved", unsolved)


def filled(store: Path, copy: Path) -> str:
    """The address of a store with a campaign and a diagnosis of it."""
    url = f"sqlite:///{shutil.copy(store, copy)}"
    with opened(url) as open_store:
        diagnosing.keep(open_store, verdicts.verdict(campaign="spring", next_runs=(NEXT,)))
    return url


class Library:
    """An object of the library with the store of a test."""

    def __init__(self, store: Store, url: str) -> None:
        self.store, self.url = store, url


Lab = tuple[TestClient, Store, str]


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lab]:
    url = f"sqlite:///{tmp_path_factory.mktemp('doors') / 'lab.db'}"
    with window(url) as (client, store):
        yield client, store, url


def variant(declared: Operation[Any, Any], values: Mapping[str, Any]) -> type[Request]:
    """The request that an example is of."""
    return next(
        (
            request
            for request in declared.variants
            if request.model_fields["method"].default == values.get("method")
        ),
        declared.request,
    )


def arguments(
    declared: Operation[Any, Any], values: Mapping[str, Any], more: Sequence[str | Path]
) -> list[str | Path]:
    """A request as it is typed, with `more` options."""
    request = variant(declared, values)
    words = list(declared.words)
    places: list[str] = []
    options: list[str] = []
    if declared.variants:
        words.append(str(values["method"]))
    for name, value in values.items():
        if name == "method":
            continue
        field = request.model_fields[name]
        if presentation_of(field).secret:
            continue  # it is read from standard input
        if presentation_of(field).positional:
            places += value if isinstance(value, tuple) else [text_of(value)]
        elif bare(field.annotation) is bool:
            options += [option_of(name, field)] if value is not field.default else []
        else:
            options += [option_of(name, field), text_of(value)]
    options += ["--yes"] if declared.deletes is not None else []
    return [*words, *options, *more, "--", *places]


def with_places(values: Mapping[str, Any], **places: Path) -> dict[str, Any]:
    """An example with the folders that it names."""
    return {
        key: part.format(**places) if isinstance(part, str) else part
        for key, part in values.items()
    }


@pytest.fixture(scope="module")
def shelf(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the campaign that examples name, which none of them changes."""
    return hammer_campaign(tmp_path_factory.mktemp("campaigns") / "shelf", 2, 1, "shelf")


@pytest.fixture(scope="module")
def prepared(
    request: pytest.FixtureRequest, shelf: Path, tmp_path_factory: pytest.TempPathFactory
) -> Callable[[str], Path]:
    """Of an example, the folder of a store with what it names; doors copy it.

    Examples before which the same is answered share one.
    """
    made: dict[str, Path] = {}

    def folder_of(name: str) -> Path:
        needed = (name in FILLED, name in DIAGNOSED, name.startswith("job-"), BEFORE.get(name))
        key = repr(needed)
        if key not in made:
            folder = tmp_path_factory.mktemp("prepared") / "lab"
            if name in FILLED:
                shutil.copytree(request.getfixturevalue("filled_lab"), folder)
            folder.mkdir(exist_ok=True)
            url = f"sqlite:///{folder / 'lab.db'}"
            if name in DIAGNOSED:
                filled(request.getfixturevalue("spring_lab") / "lab.db", folder / "lab.db")
            with opened(url, create=True) as store:
                prepare(name, store, url, shelf)
            made[key] = folder
        return made[key]

    return folder_of


def prepare(name: str, store: Store, url: str, campaign: Path) -> None:
    """Fill a store with what an example names."""
    if name.startswith("job-"):
        ask_job(store, KINDS["plan"], "Plan", KINDS["plan"].read(_SPRING))
    for other, example in BEFORE.get(name, []):
        values = with_places(example, campaign=campaign)
        declared = operation(other)
        request = read(variant(declared, values), values, "python")
        declared.answer(request, Laboratory(store, url), lambda _done, _total, _what: None)


def wrong_values(field: FieldInfo) -> Iterator[Any]:
    """Values beyond the bounds of a field, and a word that is none of its choices."""
    limits, kind = bounds(field), bare(field.annotation)
    if kind in (int, float):
        step = 1 if kind is int else 0.5
        for name, sign in (("ge", -1), ("gt", 0), ("le", 1), ("lt", 0)):
            # a number with a unit is typed as a text, which is shown as it was typed
            if name in limits and not presentation_of(field).unit:
                yield limits[name] + sign * step
        yield "magic"
    elif get_origin(kind) is Literal:
        assert "magic" not in get_args(kind)
        yield "magic"


REFUSED = [
    pytest.param(name, field_name, value, id=f"{name}-{field_name}-{value}")
    for name, values in EXAMPLES.items()
    for field_name, field in variant(operation(name), values).model_fields.items()
    if field_name != "method" and "[default:" not in str(presentation_of(field).metavar)
    for value in wrong_values(field)
]


@pytest.mark.parametrize(("name", "field_name", "value"), REFUSED)
def test_a_value_beyond_its_bounds_is_refused_with_the_same_words_at_every_door(
    lab: Lab, name: str, field_name: str, value: Any
) -> None:
    client, store, url = lab
    declared, values = operation(name), {**EXAMPLES[name], field_name: value}
    request = variant(declared, values)
    with pytest.raises(InvalidValueError) as python:
        method: Any = PythonMethod(request, declared)
        method.__set_name__(Library, "method")
        method.__get__(Library(store, url))(
            progress=False, **{key: part for key, part in values.items() if key != "method"}
        )
    argument = argument_of(field_name, request.model_fields[field_name])
    words = field_name + str(python.value).removeprefix(argument)
    assert words.startswith(f"{field_name} is ") and "; expected " in words
    if "command" not in declared.absent:
        field = request.model_fields[field_name]
        spelled = field_name if presentation_of(field).positional else option_of(field_name, field)
        store_words = ["--db", url] if declared.uses_store else []
        typed = pyroshock(*arguments(declared, values, store_words))
        assert typed.exit_code == 2
        assert f"{spelled}{words.removeprefix(field_name)}" in typed.stderr
    for door, ask in (("json", asked_as_json), ("form", asked_by_form)):
        if door not in declared.absent:
            answer = ask(client, declared, values)
            assert answer.status_code == 422
            assert {"field": field_name, "message": words} in answer.json()["faults"]


def asked_as_json(client: TestClient, declared: Operation[Any, Any], values: Any) -> Any:
    """The response of the JSON route."""
    verb, address = declared.route or ("POST", f"/{declared.name}")
    place = f"/api{address.format(**values)}"
    if verb == "GET":
        query = {key: part for key, part in values.items() if f"{{{key}}}" not in address}
        return client.get(place, params=query)
    return post_json(client, place, values)


def asked_by_form(client: TestClient, declared: Operation[Any, Any], values: Any) -> Any:
    """The response to the form."""
    sent = {key: text_of(part) for key, part in values.items()}
    action = form_page(declared).action.format(**values)
    return post(client, action, sent, headers={"X-Pyroshock-Form": "1"})


@pytest.mark.usefixtures("coarse_plates")
@pytest.mark.parametrize("name", EXAMPLES)
def test_a_request_gives_the_same_answer_at_every_door(
    prepared: Callable[[str], Path], shelf: Path, tmp_path: Path, name: str
) -> None:
    declared = operation(name)
    answers: dict[str, Any] = {}
    passing = _OF_THE_MOMENT | _OF_THE_STORE.get(name, set())
    for door in (*DOORS, "client"):
        if {"client": "json"}.get(door, door) in declared.absent:
            continue
        folder = tmp_path / door
        url = f"sqlite:///{folder / 'lab.db'}"
        shutil.copytree(prepared(name), folder)
        if name in FILLED:
            at_its_place(Registry(storage_for(url, {})))
        places = {"folder": folder / "out", "store": folder / "lab.db", "campaign": shelf}
        values = with_places(EXAMPLES[name], **places)
        # what cannot be sent is asked of the library here, without a job
        sent_on = door in ("json", "form") or (door == "client" and name not in UNSENT)
        works = sent_on and declared.long
        with window(url, works=works, folders=(tmp_path, shelf)) as (client, store):
            operations_before = operations_in_trail(store)
            answer = _answer(door, declared, values, client, Library(store, url), folder)
            with store.reading() as session:
                assert_counts_kept(session)
            added = operations_in_trail(store)[len(operations_before) :]
            assert set(added) <= {name}, "one request is one operation of the trail"
            if (name in CHANGES_NO_ROW and not works) or not declared.changes:
                assert added == []
            else:
                assert added == [name] * (2 if works else 1)
        if answer is not _SEEN_ON_A_PAGE:
            answers[door] = json.loads(
                json.dumps(lasting(answer, passing), sort_keys=True).replace(str(folder), "FOLDER")
            )
    python, remote = answers.pop("python", {}), answers.pop("client", None)
    assert remote in (None, python) or "python" in declared.absent
    first = answers.pop("command", python.get("result", answers.get("json")))
    expected = {"json": python.get("network", first)}
    assert python.get("result", first) == first
    assert all(answer == expected.get(door, first) for door, answer in answers.items()), answers


def operations_in_trail(store: Store) -> list[str]:
    """The operation of each row of the audit trail, the oldest first."""
    with store.reading() as session:
        return list(session.scalars(select(AuditRow.operation).order_by(AuditRow.id)))


def _answer(
    door: str,
    declared: Operation[Any, Any],
    values: Mapping[str, Any],
    client: TestClient,
    library: Library,
    folder: Path,
) -> Any:
    """What a door answers, as plain data."""
    if door == "command":
        words: list[str | Path] = ["--db", library.url] if declared.uses_store else []
        for key, part in values.items():
            kind = bare(variant(declared, values).model_fields[key].annotation)
            if kind in (TextFile, RecordedFile):
                table = folder / "table.csv"
                table.write_text(part, encoding="utf-8")
                values = {**values, key: str(table)}
        for output in declared.outputs:
            if output.required:
                words += [f"--{output.name}", folder / f"file{output.endings[0]}"]
        secrets = [
            str(part)
            for key, part in values.items()
            if presentation_of(variant(declared, values).model_fields[key]).secret
        ]
        command = arguments(declared, values, ["--json", *words])
        typed = run_pyroshock(*command, typed="\n".join([*secrets, ""]))
        return json.loads(typed.stdout)
    if door == "python":
        method: Any = PythonMethod(variant(declared, values), declared)
        method.__set_name__(Library, "method")
        given = {key: part for key, part in values.items() if key != "method"}
        made = method.__get__(library)(**given)
        if declared.name not in UNSENT:
            assert_same_result(made, sent(made))
        plain = made.to_json()
        return {"result": plain, "network": plain if declared.long else made.to_network_json()}
    if door == "client" and declared.name not in UNSENT:
        asked = read(variant(declared, values), values, "python")
        server = ServerAnswers(TestConnection(client))
        made = server.answer(declared, asked, progress=False)
        plain = made.to_json()
        return {"result": plain, "network": plain if declared.long else made.to_network_json()}
    if door == "client":
        return _answer("python", declared, values, client, library, folder)
    if door == "json":
        answer = asked_as_json(client, declared, values)
        assert answer.status_code in (200, 202), answer.text
        return ended(client, answer)["result"] if declared.long else answer.json()
    answer = asked_by_form(client, declared, values)
    if declared.answered_here:
        assert answer.status_code == 200
        assert "<table" in answer.text or '<p class="quiet">The answer: ' in answer.text
        return _SEEN_ON_A_PAGE
    assert answer.status_code == 200 and answer.json()["location"], answer.text
    if not declared.long:
        return _SEEN_ON_A_PAGE
    return ended(client, client.get(f"/api{answer.json()['location']}"))["result"]


def lasting(answer: Any, passing: Collection[str]) -> Any:
    """An answer as JSON, without what it says of the moment."""
    plain = json.loads(json.dumps(finite(answer)))
    if isinstance(plain, dict):
        return {key: lasting(part, passing) for key, part in plain.items() if key not in passing}
    return [lasting(part, passing) for part in plain] if isinstance(plain, list) else plain


def test_every_operation_has_an_example_and_every_door_or_a_reason() -> None:
    assert set(EXAMPLES) | ANSWERED_ELSEWHERE == set(OPERATIONS)
    for declared in operations():
        assert set(declared.absent) <= set(DOORS)
        assert all(len(reason.split()) > 3 for reason in declared.absent.values())


@pytest.mark.parametrize("name", OPERATIONS)
def test_every_field_has_a_sentence_of_help(name: str) -> None:
    for request in operation(name).requests():
        for field_name, field in request.model_fields.items():
            if field_name != "method":
                text = field.description or ""
                assert text[:1].isupper() and text.partition(" [default:")[0].endswith(".")


# --- nothing but operations

#: Commands, JSON routes and methods of the library that are no operation, with the reason.
NO_OPERATION = {
    "serve": "It starts the web application, which answers operations.",
    "demo": "It starts a tour, which asks for operations.",
    "/api/csrf": "It gives the token that a write needs.",
    "/api/ingest/upload": "Its body is a form with files, in place of the path of an ingest.",
    "/api/channels/{channel}/samples": "Its answer is a file of NumPy and no JSON.",
    "ExperimentStore.job": "It gives an object that waits for a job.",
    "/api/ingest/folders": "It names what the path of an ingest may be.",
    "PlanCollection.open": "It gives an object whose methods are operations of the plan.",
    "PlanCollection.list": "Its rows are those of `plan-list`.",
    "ExperimentStore.close": "It ends the connection to the store.",
    "ExperimentStore.plan": "It gives the methods of plans.",
    "ExperimentStore.twin": "It gives an object whose methods predict.",
    "ExperimentStore.campaigns": "Its rows are those of `campaign-list`, here or of a server.",
    "ExperimentStore.shots": "Its rows are those of `shot-list`, here or of a server.",
    "ExperimentStore.impacts": "Its rows are those of `impact-list`, read as columns of a frame.",
    "ExperimentStore.pulse": "It gives arrays of a pulse, which no other door has.",
    "ExperimentStore.recording": "It gives channels that read their samples when they are used.",
    "ExperimentStore.model": "It gives a model that predicts the pulses of a frame.",
    "ExperimentStore.diagnoses": "Its rows are those of `list-diagnoses`, without a last page.",
}


def commands_without_operation() -> Iterator[str]:
    context = click.Context(main)
    for word in main.list_commands(context):
        command = main.get_command(context, word)
        parts = (
            [command.get_command(context, name) for name in command.list_commands(context)]
            if isinstance(command, click.Group) and word not in OTHERS
            else [command]
        )
        if not all(isinstance(part, OperationCommand) for part in parts):
            yield word


def routes_without_operation(client: TestClient) -> Iterator[str]:
    routes = [declared.route or ("POST", f"/{declared.name}") for declared in operations()]
    routes += [("POST", routes[i][1]) for i, each in enumerate(operations()) if each.also_posted]
    for path, methods in client.get("/api/openapi.json").json()["paths"].items():
        if any((method.upper(), path.removeprefix("/api")) not in routes for method in methods):
            yield path


def methods_without_operation() -> Iterator[str]:
    attributes = {"_METHODS", *(attribute for _, attribute, *_ in OPERATIONS.values())}
    for owner in (ExperimentStore, PlanCollection):
        for name, member in vars(owner).items():
            if name.startswith("_") or isinstance(member, PythonMethod):
                continue
            code = inspect.unwrap(getattr(member, "fget", member)).__code__
            if not attributes & set(code.co_names):
                yield f"{owner.__name__}.{name}"


def test_only_what_is_listed_is_no_operation(lab: Lab) -> None:
    without = {
        *commands_without_operation(),
        *routes_without_operation(lab[0]),
        *methods_without_operation(),
    }
    assert without == set(NO_OPERATION)
    assert all(len(reason.split()) > 3 for reason in NO_OPERATION.values())
