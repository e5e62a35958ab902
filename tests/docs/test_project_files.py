"""Files for repository hosts and package indexes agree with the project and with each other."""

from __future__ import annotations

import re
import shlex
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml
from doc_pages.blocks import Statement, inline_statements
from doc_pages.parsing import check
from pyroshock import __version__

ROOT = Path(__file__).resolve().parents[2]
PROJECT: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))[
    "project"
]
HOST = ROOT / ".github"
FORMS = sorted((HOST / "ISSUE_TEMPLATE").glob("*.yml"))
WORKFLOW = HOST / "workflows" / "check.yml"
TEXTS = [*FORMS, HOST / "PULL_REQUEST_TEMPLATE.md", ROOT / "SECURITY.md"]
CHANGELOG = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
#: Attributes of a form's field that GitHub knows. A misspelled one makes it refuse the form.
FIELDS = {
    "markdown": {"value"},
    "input": {"label", "description", "placeholder"},
    "textarea": {"label", "description", "placeholder"},
    "dropdown": {"label", "description", "options"},
}


def content(path: Path) -> dict[str, Any]:
    loaded = yaml.safe_load(path.read_text(encoding="utf-8"))
    assert isinstance(loaded, dict)
    return loaded


def name_of(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


# --- one version, one description ---
def test_every_file_states_the_same_version_and_description() -> None:
    citation = content(ROOT / "CITATION.cff")
    assert {PROJECT["version"], citation["version"]} == {__version__}
    assert re.search(r"^## (\S+)", CHANGELOG, re.MULTILINE)[1] == __version__
    assert (
        citation["abstract"] == PROJECT["description"]
        and citation["keywords"] == PROJECT["keywords"]
    )
    assert citation["authors"] == PROJECT["authors"] and citation["title"] == PROJECT["name"]


def test_citation_has_what_its_format_requires() -> None:
    citation = content(ROOT / "CITATION.cff")
    assert (
        citation["cff-version"] == "1.2.0"
        and citation["message"]
        and citation["type"] == "software"
    )


def test_no_file_states_a_licence_that_nobody_has_chosen() -> None:
    assert [
        path.name for path in ROOT.iterdir() if re.match("(?i)licen[cs]e|copying", path.name)
    ] == []
    assert "license" not in PROJECT and "license" not in content(ROOT / "CITATION.cff")
    assert [text for text in PROJECT["classifiers"] if text.startswith("License")] == []
    for page in ("README.md", "CONTRIBUTING.md"):
        assert "No licence has been chosen yet" in (ROOT / page).read_text(encoding="utf-8")


# --- the hosted check ---
def test_workflow_runs_make_check_on_the_python_versions_of_the_classifiers() -> None:
    prefix = "Programming Language :: Python :: "
    versions = [
        text.removeprefix(prefix) for text in PROJECT["classifiers"] if text.startswith(prefix)
    ]
    (job,) = content(WORKFLOW)["jobs"].values()
    assert job["strategy"]["matrix"]["python"] == [
        text for text in versions if re.fullmatch(r"3\.\d+", text)
    ]
    assert PROJECT["requires-python"] == f">={job['strategy']['matrix']['python'][0]}"
    (python,) = [
        step["with"]
        for step in job["steps"]
        if step.get("uses", "").startswith("actions/setup-python@")
    ]
    assert python == {"python-version": "${{ matrix.python }}"}
    assert [step["run"] for step in job["steps"] if "run" in step] == ["make check"]


def test_workflow_has_no_secret_no_address_and_pins_actions_by_commit() -> None:
    text = WORKFLOW.read_text(encoding="utf-8")
    assert content(WORKFLOW)["permissions"] == {"contents": "read"}
    assert "secrets" not in text and re.findall(r"://|[\w-]+\.(?:com|io|net|org)\b", text) == []
    actions = re.findall(r"uses: (\S+)", text)
    assert len(actions) == 2
    assert [action for action in actions if not re.fullmatch(r"[\w/-]+@[0-9a-f]{40}", action)] == []


# --- forms and templates ---
@pytest.mark.parametrize("path", FORMS, ids=lambda path: path.stem)
def test_a_form_has_fields_that_the_host_knows(path: Path) -> None:
    form = content(path)
    assert set(form) == {"name", "description", "body"} and form["name"] and form["description"]
    for field in form["body"]:
        assert set(field) <= {"type", "id", "attributes", "validations"}
        assert set(field["attributes"]) <= FIELDS[field["type"]], field
        assert set(field.get("validations", {})) <= {"required"}
        assert (
            "value" in field["attributes"]
            if field["type"] == "markdown"
            else field["attributes"]["label"]
        )
        options = field["attributes"].get("options", ["one"])
        assert options and all(isinstance(option, str) for option in options), (
            "a bare yes or no is no text"
        )
    identifiers = [field["id"] for field in form["body"] if field["type"] != "markdown"]
    labels = [field["attributes"]["label"] for field in form["body"] if field["type"] != "markdown"]
    assert len(identifiers) == len(set(identifiers)) > 0 and len(labels) == len(set(labels))


def test_a_wrong_number_comes_with_what_repeats_it() -> None:
    form = content(HOST / "ISSUE_TEMPLATE" / "wrong_number.yml")
    required = {
        field["id"] for field in form["body"] if field.get("validations", {}).get("required")
    }
    assert required >= {
        "number",
        "expected",
        "steps",
        "data",
        "instruments",
        "findings",
        "version",
        "machine",
    }


@pytest.mark.parametrize("path", TEXTS, ids=name_of)
def test_commands_and_paths_in_a_text_are_there(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    lines = re.findall(r"^\s+(pyroshock .+)$", text, re.MULTILINE)
    for statement in [
        *inline_statements(path),
        *(Statement.of(shlex.split(line), name_of(path)) for line in lines),
    ]:
        check(statement)
    for named in re.findall(r"\b(?:docs/[\w/-]+\.md|examples/[\w-]*|[A-Z]+\.md)", text):
        assert (ROOT / named).exists(), named


# --- the changelog ---
def test_a_version_of_the_changelog_is_a_page_at_most() -> None:
    sections = re.split(r"^## ", CHANGELOG, flags=re.MULTILINE)[1:]
    assert [section.split()[0] for section in sections if len(section.split()) > 500] == []
    assert all(re.search(r"^- ", section, re.MULTILINE) for section in sections)
