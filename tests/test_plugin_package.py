"""A package of somebody else, built and installed by pip: fresh processes read its recordings,
diagnose its effect, and train, keep and load its model."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from pathlib import Path
from shutil import copytree

import numpy as np
import pytest
from support.records.campaigns import FS_HZ, GUN_TOML, HAMMER_TOML, blows, force_record, write_runs
from support.stores.hammer_stores import HITS, PLATE_TOML, rows_of

pytestmark = pytest.mark.timeout(600)

PACKAGE = Path(__file__).parent / "support" / "plugin_package"
STORE = "sqlite:///lab.db"
ANGLE_RAD = 0.15
#: So slow that the rise of the barrel takes more off the velocity than the tolerance of a gap.
PRESSURES_BAR, MASS_KG, TRAVEL_M = (0.08, 0.15, 0.4), 1.0, 0.9

ACTING = """
import json
import numpy as np
from pyroshock.schema.known_facts import effect_parameters
from pyroshock.twin.effects import effect
from pyroshock.twin.gun.bench import GunBench
from pyroshock.twin.gun.shots import gun_velocity

bench = GunBench(0.0095, 0.049, 0.048, 0.9, 0.2, 1.4, 1.0)
level, tilted = (
    gun_velocity(bench, [3e4, 8e4], 0.25, effects).velocity_m_s
    for effects in ((), (effect("gun.inclination", angle_rad=0.15),))
)
known = effect_parameters()["gun.inclination.angle_rad"]
print(json.dumps([(level**2 - tilted**2).tolist(), known.unit, known.high]))
"""

PREDICTING = """
import json
import numpy as np
import pyroshock as ps

with ps.open("sqlite:///lab.db") as store:
    model = store.model("nearest-pulses@1")
    frame = store.dataset("pulses").to_frame()
    pulses = model.predict(frame)
    finite = bool(np.isfinite(pulses.contact_time_s).all())
    print(json.dumps([pulses.force_n.max(axis=1).tolist(), finite]))
"""


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with nothing but the package, as pip builds and installs it without a network."""
    work = tmp_path_factory.mktemp("package")
    source = copytree(PACKAGE, work / "source")
    options = ("--no-deps", "--no-build-isolation", "--no-index", "--target", str(work / "site"))
    # isolated: options in the environment or the settings of a user are for other installations
    pip = [sys.executable, "-m", "pip", "--isolated", "install"]
    command = [*pip, "-qq", *options, str(source)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return work / "site"


class FreshProcesses:
    """Python in a folder, with the package on its path."""

    def __init__(self, installed: Path, folder: Path) -> None:
        self.folder = folder
        left_out = ("MLFLOW_TRACKING_URI", "PYROSHOCK_MODELS")
        kept = {name: value for name, value in os.environ.items() if name not in left_out}
        self._environment = kept | {"PYTHONPATH": str(installed), "PYROSHOCK_DB": STORE}

    def python(self, *words: str) -> str:
        command = [sys.executable, *words]
        done = subprocess.run(
            command,
            cwd=self.folder,
            env=self._environment,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, f"{words}\n{done.stdout}\n{done.stderr}"
        return done.stdout

    def pyroshock(self, *words: str) -> str:
        return self.python("-m", "pyroshock", *words)


@pytest.fixture(scope="module")
def lab(installed: Path, tmp_path_factory: pytest.TempPathFactory) -> FreshProcesses:
    """A store with the campaign "spring", whose recordings have the package's format."""
    processes = FreshProcesses(installed, tmp_path_factory.mktemp("lab"))
    write_hammer_campaign(processes.folder / "spring")
    processes.pyroshock("ingest", "spring")
    return processes


def write_hammer_campaign(folder: Path) -> None:
    (folder / "recordings").mkdir(parents=True)
    toml = HAMMER_TOML.format(name="spring") + PLATE_TOML
    (folder / "campaign.toml").write_text(toml, encoding="utf-8")
    rows = rows_of(4)
    for row in rows:
        row["recording"] = f"recordings/run-{row['run']}.boxlog"
    write_runs(folder, rows)
    for run in range(1, 5):
        force_n = force_record(blows(run, HITS), np.random.default_rng([1, run]))
        header = ["boxlog 1", f"rate {FS_HZ}", "channel force N", f"length {len(force_n)}"]
        lines = [*header, "samples:", *map(str, force_n.tolist())]
        path = folder / "recordings" / f"run-{run}.boxlog"
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def write_gun_campaign(folder: Path) -> None:
    """Velocities by eq. 2.16 with the weight's share along the barrel, and a scatter of 0.2 %."""
    toml = GUN_TOML.format(name="tilted")
    for name, old, new in (("efficiency", 0.5, 1.0), ("friction_coefficient", 1.4, 0.2)):
        toml = toml.replace(f"{name} = {old}", f"{name} = {new}")
    volume_m3, area_m2 = 0.0095, math.pi / 4 * 0.048**2
    share = (1 - (volume_m3 / (volume_m3 + area_m2 * TRAVEL_M)) ** 0.4) / 0.4
    rng, rows = np.random.default_rng(1), []
    for run, pressure_bar in enumerate(PRESSURES_BAR, 1):
        opposing_n = (0.2 + math.sin(ANGLE_RAD)) * MASS_KG * 9.80665
        work_j = 1e5 * pressure_bar * volume_m3 * share - opposing_n * TRAVEL_M
        for repetition in range(1, 5):
            velocity = math.sqrt(2 * work_j / MASS_KG) * (1 + 0.002 * rng.standard_normal())
            rows.append(
                {
                    "run": run,
                    "repetition": repetition,
                    "bullet_mass_kg": MASS_KG,
                    "tank_pressure_bar": pressure_bar,
                    "tip_material": "PLA",
                    "measured_velocity_m_s": round(velocity, 5),
                    "measured_velocity_u_m_s": round(0.002 * velocity, 5),
                }
            )
    folder.mkdir()
    (folder / "campaign.toml").write_text(toml, encoding="utf-8")
    write_runs(folder, rows)


def test_recordings_of_its_format_are_ingested_and_the_package_is_kept(lab: FreshProcesses) -> None:
    impacts = json.loads(lab.pyroshock("impacts", "--json"))
    peaks_n = [blow.peak_n for run in range(1, 5) for blow in blows(run, HITS)]
    assert [impact["peak_force_n"] for impact in impacts] == pytest.approx(peaks_n, rel=2e-3)
    query = (
        "SELECT software_version, format FROM provenance JOIN recordings "
        "ON provenance.id = recordings.written_by_id"
    )
    rows = json.loads(lab.pyroshock("query", query, "--json"))
    assert {tuple(row.values()) for row in rows} == {("0.1.0 with bench-extras 1.0", "boxlog")}


def test_what_it_adds_is_listed(lab: FreshProcesses) -> None:
    rows = json.loads(lab.pyroshock("plugins", "--json"))
    assert [(row["adds"], row["name"]) for row in rows] == [
        ("effect", "gun.inclination"),
        ("model", "nearest-pulses"),
        ("reader", "boxlog"),
    ]
    assert {(row["package"], row["version"], row["state"]) for row in rows} == {
        ("bench-extras", "1.0", "usable")
    }


def test_the_law_of_its_effect_acts_in_the_twin(lab: FreshProcesses) -> None:
    """Climbing takes 2 g L sin(angle) off the square of the velocity, whatever the pressure."""
    losses, unit, high = json.loads(lab.python("-c", ACTING))
    assert losses == pytest.approx([2 * 9.80665 * TRAVEL_M * math.sin(ANGLE_RAD)] * 2, rel=1e-9)
    assert (unit, high) == ("rad", 1.5)


@pytest.mark.slow
def test_its_effect_is_a_cause_of_a_diagnosis_in_its_own_words(
    installed: Path, tmp_path: Path
) -> None:
    processes = FreshProcesses(installed, tmp_path)
    write_gun_campaign(tmp_path / "tilted")
    processes.pyroshock("ingest", "tilted")
    report = json.loads(processes.pyroshock("diagnose", "tilted", "--json"))
    named = {
        name
        for cause in report["causes"]
        for effects in cause["effects"]
        for name in effects.split("+")
    }
    assert "gun.inclination" in named
    options = ("--with", "gun.inclination")
    report = json.loads(processes.pyroshock("diagnose", "tilted", *options, "--json"))
    first = report["causes"][0]
    assert first["effects"] == ["gun.inclination"] and first["probability"] > 0.5
    low, high = first["parameters"][0]["ci90"]
    assert low <= ANGLE_RAD <= high and high - low < 0.1
    page = processes.pyroshock("diagnose", "tilted", *options)
    assert "the inclination of the barrel" in page
    assert "the angle of the barrel with a spirit level" in page


@pytest.mark.slow
def test_its_model_is_trained_by_workers_and_loaded_by_another_process(lab: FreshProcesses) -> None:
    lab.pyroshock("dataset", "build", "pulses", "--from", "spring", "--quality", "none")
    options = ("--models", "nearest-pulses", "--split", "repetitions", "--jobs", "2")
    lab.pyroshock("train", "pulses", *options)
    peaks_n, finite = json.loads(lab.python("-c", PREDICTING))
    assert finite
    made = [np.mean([blow.peak_n for blow in blows(run, HITS)]) for run in range(1, 5)]
    runs = np.repeat(made, HITS)
    assert peaks_n == pytest.approx(runs, rel=0.05)
    (needs,) = {file.read_text() for file in lab.folder.rglob("requirements.txt")}
    assert "bench-extras==1.0" in needs
    repeated = lab.pyroshock("train", "pulses", *options)
    assert "nearest-pulses" in repeated


@pytest.mark.parametrize(
    "name",
    [
        "pyproject.toml",
        *(f"bench_extras/{part}.py" for part in ("recorder", "inclined_barrel", "nearest")),
    ],
)
def test_the_guide_shows_the_package_as_it_is(name: str) -> None:
    page = (PACKAGE.parents[2] / "docs" / "how-to" / "extend.md").read_text(encoding="utf-8")
    language = "toml" if name.endswith(".toml") else "python"
    content = (PACKAGE / name).read_text(encoding="utf-8")
    assert f"`bench-extras/{name}`:\n\n```{language}\n{content}```\n" in page
