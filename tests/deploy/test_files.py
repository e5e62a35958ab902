"""deploy/ names commands, options and files that exist, and holds no secret;
tests/docs/test_pages.py has its page."""

from __future__ import annotations

import os
import re
import subprocess
from pathlib import Path
from typing import Any

import click
import pytest
import yaml
from doc_pages.parsing import ROOT, parsed

DEPLOY = ROOT / "deploy"
COMPOSE: dict[str, Any] = yaml.safe_load((DEPLOY / "compose.yaml").read_text())
SERVICES: dict[str, dict[str, Any]] = COMPOSE["services"]
SCRIPTS = sorted(DEPLOY.glob("*.sh"))
#: Of the Compose specification, what a service of ours may say; a misspelled key is refused by no
#: parser.
KEYS = {
    *(
        "build",
        "cap_drop",
        "command",
        "depends_on",
        "deploy",
        "environment",
        "healthcheck",
        "image",
        "init",
        "ports",
    ),
    *("restart", "secrets", "security_opt", "shm_size", "stop_grace_period", "volumes"),
}


@pytest.mark.parametrize("name", [n for n, s in SERVICES.items() if s["command"][0] == "pyroshock"])
def test_services_run_commands_that_exist(name, monkeypatch):
    monkeypatch.setattr(click.Path, "convert", lambda self, value, *_: value)
    assert parsed([str(word) for word in SERVICES[name]["command"][1:]]).command.name == {
        "tables": "init", "window": "serve", "worker": "work",
    }[name]  # fmt: skip


@pytest.mark.parametrize("name", SERVICES)
def test_services_say_what_compose_knows(name):
    service = SERVICES[name]
    assert set(service) <= KEYS and set(service.get("depends_on", {})) <= set(SERVICES)
    assert set(service.get("secrets", [])) <= set(COMPOSE["secrets"])
    for volume in service.get("volumes", []):
        source = re.sub(r"\$\{[^}]*\}", "", volume).split(":")[0]
        assert not source or source in COMPOSE["volumes"] or (DEPLOY / source).is_file(), volume


def test_secrets_are_files_that_the_script_makes_and_no_other_file_holds_any(tmp_path):
    (tmp_path / "make-secrets.sh").write_text((DEPLOY / "make-secrets.sh").read_text())
    made = [dict(_secrets(tmp_path)) for _ in range(2)]
    assert made[0] == made[1]
    assert {f"./secrets/{name}" for name in made[0]} == {
        each["file"] for each in COMPOSE["secrets"].values()
    }
    words = [text for name, text in made[0].items() if name != "pgpass"]
    assert all(re.fullmatch("[0-9a-f]{64}", word) for word in words) and len(set(words)) == 4
    assert (tmp_path / "secrets" / "pgpass").stat().st_mode & 0o777 == 0o600
    assert f":pyroshock_lab:{made[0]['lab_password']}" in made[0]["pgpass"]
    for file in (*DEPLOY.glob("*.*"), DEPLOY / "Dockerfile"):
        text = file.read_text()
        assert not re.search(r"://[^\s/@]+:[^\s/@]+@", text), file
        for name, value in re.findall(
            r"^\s*([A-Z_]*(?:PASSWORD|TOKEN)[A-Z_]*)\s*[:=]\s*(\S+)", text, re.M
        ):
            assert value.startswith(("$(cat", "/run/secrets/", "${")), (file, name)
    assert "/deploy/secrets/" in (ROOT / ".gitignore").read_text().splitlines()
    assert "deploy/secrets" in (DEPLOY / "Dockerfile.dockerignore").read_text().splitlines()
    text = (DEPLOY / "Dockerfile").read_text()
    for source in re.findall(r"^COPY (?:--chmod=\d+ )?(\S+) ", text, re.MULTILINE):
        assert source.startswith("--from=") or (ROOT / source).exists(), source
    assert re.findall(r"^USER (\S+)", text, re.MULTILINE) == ["pyroshock"] and "--uid 10001" in text


def _secrets(folder: Path) -> list[tuple[str, str]]:
    subprocess.run(["/bin/sh", str(folder / "make-secrets.sh")], check=True, capture_output=True)
    return [(file.name, file.read_text()) for file in sorted((folder / "secrets").iterdir())]


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda p: p.name)
def test_scripts_are_shell(script):
    assert os.access(script, os.X_OK)
    subprocess.run(["/bin/sh", "-n", str(script)], check=True)
