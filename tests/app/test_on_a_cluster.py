"""The commands that share work out, on a Dask cluster: word for word what they give on this
machine."""

from __future__ import annotations

import json

import pytest
from support.processes.dask_clusters import dask_cluster
from support.records.campaigns import hammer_campaign
from support.stores.stores import content, ingested, run_pyroshock

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]

SHOTS = """run,tip_material,tip_radius_mm,bullet_mass_kg,tank_pressure_bar
1,steel,45,0.5,2
2,aluminum,30,0.5,1.5
3,PLA,60,1,3
"""


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    with dask_cluster(tmp_path_factory.mktemp("cluster")) as running:
        yield ("--backend", "dask", "--scheduler", running.address)


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("MLFLOW_TRACKING_URI", "PYROSHOCK_DB"):
        monkeypatch.delenv(name, raising=False)
    return tmp_path


def test_predictions_of_a_table(folder, cluster):
    (folder / "shots.csv").write_text(SHOTS)
    for name, where in (("here", ()), ("there", cluster)):
        files = ("--out", f"{name}.csv", "--spectra", f"{name}-s.csv")
        run_pyroshock("predict", "--shots", "shots.csv", "--draws", "8", *files, *where)
    assert (folder / "here.csv").read_bytes() == (folder / "there.csv").read_bytes()
    assert (folder / "here-s.csv").read_bytes() == (folder / "there-s.csv").read_bytes()


def test_pulses_cut_anew(folder, cluster):
    campaign = hammer_campaign(folder / "c", recordings=6)
    for name, where in (("here", ()), ("there", cluster)):
        url = f"sqlite:///{folder / name}.db"
        ingested(url, campaign)
        run_pyroshock("extract", "hammer", "--threshold", "0.03", "--db", url, *where)
    assert content(f"sqlite:///{folder / 'here'}.db") == content(f"sqlite:///{folder / 'there'}.db")


def test_answers_of_a_blind_check(folder, cluster):
    """All but the seconds that the answers took."""
    said = []
    for name, where in (("here", ("--jobs", "1")), ("there", cluster)):
        words = (
            "--cases",
            "2",
            "--seed",
            "5",
            "--tier",
            "strong",
            "--no-baselines",
            "--no-shrinkage",
        )
        run_pyroshock("blind-check", *words, "--folder", name, *where)
        rows = [
            json.loads(line) for line in (folder / name / "answers.jsonl").read_text().splitlines()
        ]
        said.append(sorted(json.dumps(without_times(row), sort_keys=True) for row in rows))
    assert len(said[0]) == 2 and said[0] == said[1]


def without_times(value):
    if isinstance(value, dict):
        return {
            key: without_times(each)
            for key, each in value.items()
            if key not in ("seconds", "cpu_s")
        }
    return [without_times(each) for each in value] if isinstance(value, list) else value
