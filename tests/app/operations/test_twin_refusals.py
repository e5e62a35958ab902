"""What `tune` and `validate` refuse: the same values, with the same words, at every door."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from pyroshock.app.doors.command_line.operation_command import option_of
from pyroshock.app.operations.catalogue import operation
from pyroshock.app.operations.faults import RequestError, read
from pyroshock.app.operations.form import form_page
from pyroshock.app.operations.operation import Operation
from starlette.testclient import TestClient
from support.processes.web_client import post, post_json, sqlite, window
from support.stores.stores import pyroshock

SPECIFICATION = "frequency_hz,level_g\n100,30\n1000,300\n"
NEEDED = {"tune": {"target": SPECIFICATION}, "validate": {"campaign": "spring"}}
SEED = "is 99999999999; expected a whole number from 0 to 2147483647"
SHARE = "expected a number above 0, up to 1"
POINT = "expected two numbers in m, such as 0.47,0.28"


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[TestClient, Path]]:
    folder = tmp_path_factory.mktemp("refusals")
    (folder / "spec.csv").write_text(SPECIFICATION)
    with window(sqlite(folder)) as (client, _):
        yield client, folder


def refused_by_command(
    declared: Operation[Any, Any], field: str, value: Any, folder: Path
) -> tuple[str, str]:
    """The words, and how the field is spelled in them."""
    needed = ["spring"] if declared.name == "validate" else ["--target", folder / "spec.csv"]
    option = option_of(field, declared.request.model_fields[field])
    typed = pyroshock(declared.name, *needed, option, value, "--db", sqlite(folder))
    assert typed.exit_code == 2 and typed.stderr.count("\n") == 1, typed.stderr
    return typed.stderr, option


@pytest.mark.parametrize("door", ["command", "json", "form", "python"])
@pytest.mark.parametrize(("name", "field", "value", "words"), [
    ("tune", "seed", 99999999999, SEED),
    ("tune", "impact_at", "1,2,3", f"is '1,2,3'; {POINT}"),
    ("tune", "sensor_at", "0.4", f"is '0.4'; {POINT}"),
    ("tune", "share", 0, f"is 0; {SHARE}"),
    ("tune", "at_least", 1.5, f"is 1.5; {SHARE}"),
    ("tune", "q", 0.5, "is 0.5; expected a number above 0.5, up to 1000"),
    ("tune", "tolerance", "much", "is 'much'; expected one such as 6dB, +9/-6dB or"),
    ("tune", "bullet_mass", "5 bar", "is '5 bar'"),
    ("validate", "folds", 1, "is 1; expected a whole number from 2 to 1000"),
    ("validate", "draws", 2001, "is 2001; expected a whole number from 20 to 2000"),
    ("validate", "seed", 99999999999, SEED),
])  # fmt: skip
def test_the_same_value_is_refused_with_the_same_words(
    lab: tuple[TestClient, Path], door: str, name: str, field: str, value: Any, words: str
) -> None:
    client, folder = lab
    declared = operation(name)
    values = {**NEEDED[name], field: value}
    if door == "command":
        told, option = refused_by_command(declared, field, str(value), folder)
        assert f"{option} {words}" in told
        return
    if door == "python":
        with pytest.raises(RequestError) as caught:
            read(declared.request, values, "python")
        faults = [vars(fault) for fault in caught.value.faults]
    else:
        sent = {key: str(part) for key, part in values.items()}
        answer = (
            post_json(client, f"/api/{name}", values)
            if door == "json"
            else post(client, form_page(declared).action, sent, headers={"X-Pyroshock-Form": "1"})
        )
        assert answer.status_code == 422, answer.text
        faults = answer.json()["faults"]
    (fault,) = faults
    assert fault["field"] == field and fault["message"].startswith(f"{field} {words}")


def test_every_door_has_every_field(lab: tuple[TestClient, Path]) -> None:
    client, _ = lab
    page = client.get("/tune").text
    help_text = pyroshock("tune", "--help").stdout
    for field_name, field in operation("tune").request.model_fields.items():
        assert f'name="{field_name}"' in page, field_name
        assert option_of(field_name, field) in help_text
