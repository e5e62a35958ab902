"""The three disclosed campaigns, by the command line alone, from their folders."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from support.stores.stores import pyroshock

DISCLOSED = {
    "gun-valve-flow": "gun.valve_flow",
    "hammer-effective-mass": "contact.effective_mass",
    "plate-damping": "plate.damping",
}


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize("name", DISCLOSED)
def test_disclosed_cause_is_in_the_first_group(
    shared: Path, tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    page = tmp_path / "gap.html"
    result = pyroshock("diagnose", shared / "examples" / name, "--json", "--html", page)
    assert result.exit_code == 0, result.stderr
    said = json.loads(result.stdout)
    first = said["causes"][0]
    assert not any("outside of the catalogue" in note for note in said["assumptions"])
    assert DISCLOSED[name] in first["effects"] and len(first["effects"]) <= 4
    # Of every set, with small second effects or without, in which one of the first entry's effects acts.
    alike = set(first["effects"])
    acts = [cause for cause in said["causes"] if all(alike & set(names.split("+")) for names in cause["effects"])]
    assert sum(cause["probability"] for cause in acts) >= 0.9
    assert first["probability"] == max(cause["probability"] for cause in said["causes"])
    assert f"<title>Diagnosis: {name}</title>" in page.read_text(encoding="utf-8")
    assert list(tmp_path.iterdir()) == [page]
