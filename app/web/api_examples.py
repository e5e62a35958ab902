"""How to call a route of the API: from a shell, from the Python library, and as JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from .api_field import ApiField

#: Operation -> how the Python library asks for it, of a `store` that `ps.open` has opened.
CLIENT_CALLS = {
    "adopt": 'store.adopt(store.diagnosis(1), effect="gun.valve_flow")',
    "attachment-add": 'store.attach("plate.jpg", campaign="spring", caption="the plate")',
    "attachment-get": 'store.attachment(1).write("plate.jpg")',
    "attachment-list": 'store.attachments(campaign="spring")',
    "attachment-remove": 'store.remove_attachment(1, reason="another plate")',
    "attachment-restore": "store.restore_attachment(1)",
    "blind-check": "store.blind_check(cases=5)",
    "campaign-page": "store.campaigns()",
    "channel-window": 'store.recording(12)["force"].between(0.10, 0.11)',
    "compare": 'store.compare("linear@1", "tree@1")',
    "dataset-build": 'store.dataset("spring-1", campaigns=["spring"])',
    "dataset-list": "store.datasets()",
    "dataset-show": 'store.dataset("spring-1").to_frame()',
    "db-check": "store.check()",
    "delete-diagnosis": "store.delete_diagnosis(1)",
    "diagnose": 'store.diagnose("spring")',
    "explore": 'store.explore(kind="control", y="peak_force_n")',
    "extract": 'store.extract("spring", threshold=0.02)',
    "impact-list": 'store.impacts(campaign="spring", where="peak_force_n > 1000")',
    "ingest": 'store.ingest("spring/")',
    "job-list": "store.jobs()",
    "job-show": "store.job(1).view",
    "job-stop": "store.job(1).cancel()",
    "list-diagnoses": "store.diagnoses()",
    "material-list": "store.materials()",
    "model-list": "store.models()",
    "model-show": 'store.model("linear@1")',
    "plan": 'store.plan.lhs("summer", runs=105)',
    "plan-list": "store.plan.list()",
    "plan-next-runs": 'store.plan.discriminate(1, name="apart")',
    "plan-predict": 'store.plan.predict("summer")',
    "plan-predictions": 'store.plan.predictions("summer")',
    "plan-quality": 'store.plan.open("summer").quality()',
    "plan-status": 'store.plan.open("summer")',
    "plugins": "store.plugins()",
    "predict": 'store.twin().predict(tank_pressure="5 bar")',
    "promote": 'store.promote("tree@1", reason="a start")',
    "query": 'store.query("select name from materials")',
    "shot-list": "store.shots()",
    "show-diagnosis": "store.diagnosis(1)",
    "train": 'store.train("spring-1", models=["linear", "tree"])',
    "tune": 'store.twin().tune("spectrum.csv")',
    "twin": "store.twin()",
    "validate": 'store.validate("spring")',
}
#: What an example writes for a value of a type, where the schema has neither default nor example.
_VALUES: dict[str, Any] = {
    "integer": 1,
    "number": 1.0,
    "boolean": True,
    "array": [],
    "object": {},
    "string": "NAME",
}


@dataclass(frozen=True)
class Example:
    """A request: as a command of a shell, as a line of Python, and its body."""

    curl: str
    python: str
    client: str
    body: str


def example_value(row: ApiField) -> Any:
    """A value that a field takes."""
    if row.default:
        return json.loads(row.default)
    if row.example:
        return row.example
    if row.choices:
        return True if row.type == "boolean" else row.choices[0]
    if row.type.startswith("list of"):
        return []
    return _VALUES.get(row.type, "VALUE")


def example_of(
    origin: str,
    path: str,
    method: str,
    media: str,
    fields: Sequence[ApiField],
    sent: Mapping[str, Any],
    client: str,
) -> Example:
    """The example of a route; `sent` is the body of a write, `client` the call of the library."""
    address = _address(path, fields)
    return Example(
        _curl(f"{origin}{address}", method, media, sent),
        _python(address, method, media, sent),
        client,
        json.dumps(sent, indent=2) if method == "post" and "json" in media else "",
    )


def _address(path: str, fields: Sequence[ApiField]) -> str:
    """The path with names in capitals, and with the parameters that it cannot do without."""
    for row in fields:
        if row.place == "path":
            path = path.replace(f"{{{row.name}}}", row.name.upper())
    needed = "&".join(
        f"{row.name}=VALUE" for row in fields if row.place == "query" and row.required
    )
    return f"{path}?{needed}" if needed else path


def _curl(address: str, method: str, media: str, body: Mapping[str, Any]) -> str:
    if method == "get":
        return f"curl '{address}'"
    # the name of a shell's variable
    token = '-b cookies.txt -H "X-CSRF-Token: $TOKEN"'  # noqa: S105  the name of a variable of the shell
    if media.startswith("multipart/"):
        return f"curl {token} -F 'files=@FILE' '{address}'"
    return f"curl {token} -H 'Content-Type: application/json' -d '{json.dumps(body)}' '{address}'"


def _python(address: str, method: str, media: str, body: Mapping[str, Any]) -> str:
    if media.startswith("multipart/"):
        return ""  # the standard library has no upload of files
    return f'call("{address}")' if method == "get" else f'call("{address}", {dict(body)!r})'
