"""Every operation through every door: the same request gives the same answer and the same refusal.

An operation that lacks a door says why. The values that are refused follow from the bounds of the
fields, so that a new operation is tested as soon as it has a row in `EXAMPLES`.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

import pytest
from pydantic.fields import FieldInfo
from pyroshock.app.common.errors import InvalidValueError
from pyroshock.app.doors.command_line.operation_command import option_of
from pyroshock.app.doors.python import PythonMethod
from pyroshock.app.operations.catalogue import OPERATIONS, operation, operations
from pyroshock.app.operations.diagnose import diagnosing
from pyroshock.app.operations.faults import bare, bounds
from pyroshock.app.operations.fields import presentation_of
from pyroshock.app.operations.form import form_page, text_of
from pyroshock.app.operations.operation import DOORS, Operation, Request
from pyroshock.diagnosis.verdict import NextRun
from pyroshock.schema.session import Store
from pyroshock.validation import blind_check
from starlette.testclient import TestClient
from support.processes.web_client import ended, post, post_json, window
from support.records import verdicts
from support.stores.stores import opened, pyroshock, run_pyroshock

#: A request that can be answered, of each operation.
EXAMPLES: dict[str, dict[str, Any]] = {
    "plan": {"name": "spring", "method": "sobol", "runs": 4, "seed": 3, "repetitions": 2},
    "diagnose": {"campaign": "spring", "seed": 1, "with_effects": ["gun.valve_flow"]},
    "plan-next-runs": {"diagnosis": 1, "name": "apart"},
    "adopt": {"diagnosis": 1, "effect": "contact.layer_compliance"},
    "list-diagnoses": {"campaign": "spring"},
    "show-diagnosis": {"diagnosis": 1},
    "delete-diagnosis": {"diagnosis": 1},
    "blind-check": {"cases": 1, "tiers": ["weak"], "split": "development"},
}
#: Operations on a plan that is in the store already: tests/app/test_plans.py.
TESTED_ELSEWHERE = {
    name for name in OPERATIONS if name.startswith("plan-") and name not in EXAMPLES
} | {"simulate"}
#: What differs from answer to answer: keys of rows, and times.
_OWN = ("id", "diagnosed_at")
NEXT = NextRun("separates A from B", {"tank_pressure_bar": 0.45, "bullet_mass_kg": 0.1428}, 4)


class MadeUpScore:
    """The report of a blind check, which takes minutes."""

    tiers = ()

    def as_json(self) -> dict[str, Any]:
        return {"tiers": [{"tier": "weak", "first": 1.0, "ece": float("nan")}]}


@pytest.fixture(autouse=True)
def made_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """Diagnoses and blind checks are made up."""
    answer = verdicts.verdict(campaign="spring", next_runs=(NEXT,))
    monkeypatch.setattr(diagnosing, "run_diagnosis", lambda *_, **__: answer)
    monkeypatch.setattr(blind_check, "run", lambda *_, **__: MadeUpScore())


def filled(store: Path, copy: Path) -> str:
    """The address of a store with a campaign and a diagnosis of it."""
    url = f"sqlite:///{shutil.copy(store, copy)}"
    with opened(url) as open_store:
        diagnosing.keep(open_store, verdicts.verdict(campaign="spring", next_runs=(NEXT,)))
    return url


def comparable(answer: Any) -> Any:
    """An answer without keys of rows and times."""
    if isinstance(answer, list):
        return [comparable(item) for item in answer]
    if isinstance(answer, dict):
        return {key: item for key, item in answer.items() if key not in _OWN}
    return answer


def asked_as_json(client: TestClient, declared: Operation[Any, Any], values: Any) -> Any:
    """The response of the JSON route."""
    method, address = declared.route or ("POST", f"/{declared.name}")
    place = f"/api{address.format(**values)}"
    if method == "GET":
        query = {key: part for key, part in values.items() if f"{{{key}}}" not in address}
        return client.get(place, params=query)
    return post_json(client, place, values)


def asked_by_form(client: TestClient, declared: Operation[Any, Any], values: Any) -> Any:
    """The response to the form."""
    sent = {key: text_of(part) for key, part in values.items()}
    action = form_page(declared).action.format(**values)
    return post(client, action, sent, headers={"X-Pyroshock-Form": "1"})


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


def arguments(declared: Operation[Any, Any], values: Mapping[str, Any]) -> list[str]:
    """A request as it is typed."""
    request = variant(declared, values)
    words, options = list(declared.words), []
    if declared.variants:
        words.append(str(values["method"]))
    for name, value in values.items():
        if name == "method":
            continue
        field = request.model_fields[name]
        if presentation_of(field).positional:
            words.append(text_of(value))
        elif bare(field.annotation) is bool:
            options += [option_of(name, field)] if value is not field.default else []
        else:
            options += [option_of(name, field), text_of(value)]
    return words + options


def wrong_values(field: FieldInfo) -> Iterator[Any]:
    """Values beyond the bounds of a field, and a word that is none of its choices."""
    limits, kind = bounds(field), bare(field.annotation)
    if kind in (int, float):
        step = 1 if kind is int else 0.5
        for name, sign in (("ge", -1), ("gt", 0), ("le", 1), ("lt", 0)):
            if name in limits:
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
    words = str(python.value)
    assert words.startswith(f"{field_name} is ") and "; expected " in words
    if "command" not in declared.absent:
        field = request.model_fields[field_name]
        spelled = field_name if presentation_of(field).positional else option_of(field_name, field)
        store_words = ("--db", url) if declared.uses_store else ()
        typed = pyroshock(*arguments(declared, values), *store_words)
        assert typed.exit_code == 2
        assert f"{spelled}{words.removeprefix(field_name)}" in typed.stderr
    if "json" not in declared.absent:
        answer = asked_as_json(client, declared, values)
        assert answer.status_code == 422
        assert {"field": field_name, "message": words} in answer.json()["faults"]
    if "form" not in declared.absent:
        answer = asked_by_form(client, declared, values)
        assert answer.status_code == 422
        assert {"field": field_name, "message": words} in answer.json()["faults"]


@pytest.mark.parametrize("name", EXAMPLES)
def test_a_request_gives_the_same_answer_at_every_door(
    tmp_path: Path, spring_lab: Path, name: str
) -> None:
    declared, values = operation(name), EXAMPLES[name]
    answers: dict[str, Any] = {}

    def store_of(door: str) -> str:
        place = tmp_path / f"{door}.db"
        return f"sqlite:///{place}" if name == "plan" else filled(spring_lab / "lab.db", place)

    if "command" not in declared.absent:
        words = ["--db", store_of("command")] if declared.uses_store else []
        words += ["--yes"] if declared.deletes is not None else []
        typed = run_pyroshock(*arguments(declared, values), "--json", *words)
        answers["command"] = json.loads(typed.stdout)
    with window(store_of("json")) as (client, _):
        answer = asked_as_json(client, declared, values)
        answers["json"] = ended(client, answer)["result"] if declared.long else answer.json()
    if "form" not in declared.absent:
        with window(store_of("form")) as (client, _):
            answer = asked_by_form(client, declared, values)
            assert answer.status_code == 200 and answer.json()["location"]
            if declared.long:
                job = client.get(f"/api{answer.json()['location']}")
                answers["form"] = ended(client, job)["result"]
    url = store_of("python")
    with window(url, works=False) as (_, store):
        method: Any = PythonMethod(variant(declared, values), declared)
        method.__set_name__(Library, "method")
        given = {key: part for key, part in values.items() if key != "method"}
        answers["python"] = method.__get__(Library(store, url))(**given).to_json()
    expected = comparable(answers["json"])
    assert all(comparable(answer) == expected for answer in answers.values())


def test_every_operation_has_an_example_and_every_door_or_a_reason() -> None:
    assert set(EXAMPLES) | TESTED_ELSEWHERE == set(OPERATIONS)
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
