"""`diagnose` as a laboratory uses it: what it prints, keeps, refuses; and the disclosed
campaigns."""

from __future__ import annotations

import csv
import json
import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import Result
from pyroshock.app.operations.diagnose import diagnosing
from pyroshock.app.operations.diagnose.diagnosing import record_of
from pyroshock.app.operations.diagnose.request import DiagnosisRequest
from pyroshock.app.twins import building as twins
from pyroshock.diagnosis.verdict import Cause, Verdict
from support.records import verdicts
from support.records.campaigns import gun_campaign, replace_in, write_runs
from support.records.plate_folders import plate_campaign
from support.stores.stores import counts, pyroshock, run_pyroshock

Diagnose = Callable[..., Result]


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[DiagnosisRequest]:
    """What the command asks for; every answer is the made-up one, named after the target."""
    found: list[DiagnosisRequest] = []

    def made_up(
        store: object, db: str, asked: DiagnosisRequest, progress: object = None
    ) -> Verdict:
        found.append(asked)
        return verdicts.verdict(campaign=Path(asked.campaign).name)

    monkeypatch.setattr(diagnosing, "run_diagnosis", made_up)
    return found


@pytest.fixture
def lab(spring_lab: Path, tmp_path: Path) -> str:
    shutil.copytree(spring_lab / "folder", tmp_path / "folder")
    return f"sqlite:///{shutil.copy(spring_lab / 'lab.db', tmp_path)}"


def done(*words: str | Path) -> Result:
    return run_pyroshock("diagnose", *words)


def test_report_is_json_a_page_or_words(
    asked: list[DiagnosisRequest], lab: str, tmp_path: Path
) -> None:
    assert json.loads(done("spring", "--db", lab, "--json").stdout) == verdicts.verdict().as_json()
    done("spring", "--db", lab, "--json", tmp_path / "report.json", "--html", tmp_path / "gap.html")
    assert json.loads((tmp_path / "report.json").read_text())["campaign"] == "spring"
    page = (tmp_path / "gap.html").read_text()
    assert "<h1>spring</h1>" in page and "The model error is 4.1 times the tolerance" in page
    told = done("spring", "--db", lab).stdout
    assert told.startswith(
        "The model error is 4.1 times the tolerance and 4.6 times the measurement noise; "
    )
    assert headings(told) == [
        "What to do next", "Size of the model error", "Causes", "Where the error lies",
        "On configurations that the fit has not seen",
        "The next experiment", "Runs of the next experiment", "Assumptions",
    ]  # fmt: skip
    assert re.search(r"^93 % +contact\.layer_compliance \(80 %\) or", told, re.MULTILINE)


def headings(told: str) -> list[str]:
    return [block.splitlines()[0] for block in told.split("\n\n")[1:]]


def test_words_follow_the_verdict_and_not_finite_numbers_are_null(
    monkeypatch: pytest.MonkeyPatch, lab: str
) -> None:
    monkeypatch.setattr(diagnosing, "run_diagnosis", lambda *_, **__: verdicts.gun())
    told = done("spring", "--db", lab).stdout
    assert [line.split("  ")[0] for line in headings(told)[:5]] == [
        "What to do next",
        "Size of the model error",
        "Effects (share of the squared error)",
        "Sets of effects of which at least one acts",
        "Path of the model error on configurations that the fit has not seen",
    ]
    rows = [" ".join(line.split()) for line in told.splitlines()]
    assert "gun.valve_flow 61 % 52 to 68 % 99 % 58 % 1 yes loss coefficient = 31 (27 to 36)" in rows
    assert "unexplained 3 % 1 to 6 %" in rows
    assert [row for row in rows if row.startswith(("nominal model ", "+ ",
    "measurement noise "))] == [
        "nominal model 0.42", "+ gun.valve_flow 0.164 61 %", "+ gun.back_pressure 0.05 88 %",
        "+ gun.blow_by 0.0126 97 %", "measurement noise 0.00424",
    ]  # fmt: skip
    monkeypatch.setattr(
        diagnosing, "run_diagnosis", lambda *_, **__: verdicts.unknown(next_runs=())
    )
    told = done("spring", "--db", lab).stdout
    experiment = told.partition("\nThe next experiment\n")[2]
    assert experiment.startswith("  Fire three repetitions") and "needed" not in experiment
    assert "gun.valve_flow" in told and "contact.viscous_loss" in told
    sentence = "The diagnosis considers only gun.valve_flow (--with), and no other effect."
    monkeypatch.setattr(
        diagnosing, "run_diagnosis", lambda *_, **__: verdicts.gun(assumptions=(sentence,))
    )
    assert done("spring", "--db", lab).stdout.startswith(f"{sentence}\nThe model error is 42 times")
    gap = replace(verdicts.verdict().gap, noise_floor=float("nan"))
    monkeypatch.setattr(diagnosing, "run_diagnosis", lambda *_, **__: verdicts.verdict(gap=gap))
    assert json.loads(done("spring", "--db", lab, "--json").stdout)["gap"]["noise_floor"] is None


def test_list_tells_each_diagnosis_and_a_folder_leaves_nothing_behind(asked, lab, tmp_path):
    done("spring", "--db", lab, "--adopt", "gun.valve_flow")
    done("spring", "--db", lab, "--adopt", "none")
    done("spring", "--db", lab, "--seed", "1")
    rows = json.loads(done("spring", "--db", lab, "--list", "--json").stdout)
    assert [row["adopted"] for row in rows] == [
        None,
        "version 2: none",
        "version 1: gun.valve_flow",
    ]
    assert [row["first"] for row in rows] == [
        "contact.layer_compliance or contact.plate_compliance"
    ] * 3
    assert rows[0]["id"] > rows[1]["id"]
    listed = done("spring", "--db", lab, "--list").stdout
    assert "  contact.layer_compliance or contact.plate_compliance  93 %  " in re.sub(
        "   +", "  ", listed
    )
    before, files = counts(lab), sorted(tmp_path.rglob("*"))
    done(tmp_path / "folder", "--db", lab)
    done(tmp_path / "folder", "--db", f"sqlite:///{tmp_path / 'none.db'}")
    assert counts(lab) == before and sorted(tmp_path.rglob("*")) == files


def test_options_reach_the_diagnosis(asked: list[DiagnosisRequest], lab: str) -> None:
    done("spring", "--db", lab, "--seed", "3", "--tolerance", "gun=2%", "--tolerance",
    "plate=0.7dB",
         "--uncertain", "gun.friction_coefficient=0.05", "--simulator",
         "models:/hybrid@2")  # fmt: skip
    (one,) = asked
    assert one.tolerances == pytest.approx({"gun": 0.02, "plate": 0.7})
    assert one.uncertain == {"gun.friction_coefficient": 0.05}
    assert (one.seed, one.simulator) == (3, "models:/hybrid@2")


def test_effects_are_named_one_by_one_or_in_a_list(asked: list[DiagnosisRequest], lab: str) -> None:
    done("spring", "--db", lab, "--with", "gun.valve_flow", "--with", "gun.blow_by, gun.valve_flow",
         "--without", "sensor.velocity_gain,sensor.pressure_gain", "--uncertain",
         "impactor_mass_kg=0.002")  # fmt: skip
    (one,) = asked
    assert one.with_effects == ("gun.valve_flow", "gun.blow_by")
    assert one.without_effects == ("sensor.velocity_gain", "sensor.pressure_gain")
    assert one.uncertain == {"contact.impactor_mass_kg": 0.002}  # a number needs no stage


@pytest.mark.parametrize(("words", "shown"), [
    (("--with", "gun.valve_flow", "--with", "gun.blow_by"), {"gun.valve_flow", "gun.blow_by"}),
    (("--with", "gun.valve_flow,gun.blow_by", "--without", "gun.blow_by"), {"gun.valve_flow"}),
])  # fmt: skip
def test_restricted_diagnosis_names_no_other_effect_and_says_so(
    lab: str, words: tuple[str, ...], shown: set[str]
):
    """The diagnosis itself, on the five shots of "spring"."""
    report = json.loads(done("spring", "--db", lab, *words, "--json").stdout)
    named = {
        part for cause in report["causes"] for name in cause["effects"] for part in name.split("+")
    }
    assert (
        named - {"none", "unknown"} <= shown
        and {effect["effect"] for effect in report["effects"]} <= shown
    )
    assert report["assumptions"][0].startswith(
        "The diagnosis considers only gun.valve_flow, gun.blow_by (--with)"
    )
    assert ("gun.blow_by (--without)" in report["assumptions"][1]) == ("--without" in words)


@pytest.mark.parametrize(("words", "message"), [
    (("--with", "gun.magic"),
     "--with 'gun.magic': the catalogue has no such effect; it has gun.back_pressure"),
    (("--without", "gun.magic"), "--without 'gun.magic': the catalogue has no such effect"),
    (("--with", "plate.damping"),
     "the channels of spring cannot show this effect; they can show gun.back_p"),
    (("--with", "gun.blow_by", "--without", "gun.blow_by"),
     "leave no effect to consider for spring"),
])  # fmt: skip
def test_effect_that_cannot_be_considered_is_one_line_and_stores_nothing(
    lab: str, words, message
) -> None:
    before = counts(lab)
    result = pyroshock("diagnose", "spring", "--db", lab, *words)
    assert result.exit_code == 2
    (line,) = result.stderr.strip().splitlines()
    assert message in line and counts(lab) == before


@pytest.mark.parametrize("answer", ["none", "unknown"])
def test_every_answer_is_a_finished_diagnosis(
    monkeypatch: pytest.MonkeyPatch, lab: str, answer: str
) -> None:
    found = replace(verdicts.verdict(), causes=(Cause((answer,), 1.0),))
    monkeypatch.setattr(diagnosing, "run_diagnosis", lambda *_, **__: found)
    assert pyroshock("diagnose", "spring", "--db", lab).exit_code == 0


@pytest.mark.parametrize(("words", "message"), [
    (("summer",), "no campaign and no folder 'summer'; campaigns: spring"),
    (("spring", "--simulator", "magic"),
     "--simulator is 'magic'; expected nominal, or MODEL@VERSION"),
    (("spring", "--simulator", "models:/hybrid@1"), "no registered model 'hybrid@1'"),
    (("spring", "--tolerance", "gun=1"), "--tolerance is 'gun=1'; expected gun=1%"),
    (("spring", "--tolerance", "laser=1%"), "--tolerance is 'laser=1%'"),
    (("spring", "--uncertain", "friction_coefficient"),
     "'friction_coefficient'; expected NUMBER=SD, such as gun."),
    (("spring", "--uncertain", "bullet_mass=0.1"),
     "no number 'bullet_mass'; the nearest is gun.bullet_mass_kg"),
    (("spring", "--uncertain", "contact.friction_coeff=1"),
     "the nearest is gun.friction_coefficient"),
    (("spring", "--uncertain", "weather=0.1"),
     "no number 'weather'; there are gun.tank_volume_m3, "),
    (("spring", "--uncertain", "travel_m=-1"), "'travel_m=-1'; expected NUMBER=SD"),
    (("spring", "--list", "--db", "sqlite:///none.db"), "no store at"),
    (("summer", "--list"), "'summer'"),
])  # fmt: skip
def test_what_a_user_can_mend_is_one_line(
    lab: str, tmp_path, words: tuple[str, ...], message: str, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)
    result = pyroshock("diagnose", *words, *(() if "--db" in words else ("--db", lab)))
    assert result.exit_code == 2 and message in result.stderr.strip().splitlines()[-1]


@pytest.mark.parametrize("words", [
    ("--adopt", "gun.valve_flow,gun.back_pressure,gun.blow_by"),
    ("--adopt", "gun.valve_flow", "--adopt", "gun.blow_by, gun.back_pressure"),
    ("--adopt", "gun.valve_flow+gun.back_pressure+gun.blow_by"),
])  # fmt: skip
def test_effects_of_a_set_are_adopted_together_and_joined_by_words(monkeypatch, asked, lab, words):
    monkeypatch.setattr(diagnosing, "run_diagnosis", lambda *_, **__: verdicts.gun())
    result = done("spring", "--db", lab, *words)
    joined = "gun.valve_flow, gun.back_pressure and gun.blow_by"
    assert (
        re.search(rf"^93 % +{joined} ", result.stdout, re.MULTILINE)
        and "gun.valve_flow and gun.back_pressure" in result.stdout
    )
    assert re.search(
        r"adopted as version 1: diagnosis of spring: gun\.\w+, gun\.\w+ and gun\.\w+, ",
        result.stderr,
    )
    assert "--adopt gun.valve_flow,gun.back_pressure,gun.blow_by" in result.stdout
    listed = (
        done("spring", "--db", lab, "--list").stdout + pyroshock("diagnoses", "--db", lab).stdout
    )
    texts = (result.stdout, result.stderr, listed)
    assert not any(re.search(r"[a-z] ?\+ ?gun", text.replace("+ gun.", "")) for text in texts)
    (row,) = json.loads(done("spring", "--db", lab, "--list", "--json").stdout)
    assert row["first"] == "gun.valve_flow+gun.back_pressure+gun.blow_by"


def test_set_that_cannot_be_adopted_stores_nothing(asked: list[DiagnosisRequest], lab: str) -> None:
    before = counts(lab)
    result = pyroshock("diagnose", "spring", "--db", lab, "--adopt", "gun.blow_by")
    assert result.exit_code == 2
    assert (
        result.stderr.strip()
        .splitlines()[-1]
        .endswith(
            "has no fit of 'gun.blow_by'; it has: contact.layer_compliance; gun.valve_flow; none"
        )
    )
    assert counts(lab) == before


def test_folder_cannot_adopt(asked: list[DiagnosisRequest], tmp_path: Path) -> None:
    folder = gun_campaign(tmp_path / "folder")
    result = pyroshock(
        "diagnose", folder, "--adopt", "gun.valve_flow", "--db", f"sqlite:///{tmp_path / 'none.db'}"
    )
    assert result.exit_code == 2 and "ingest it first" in result.stderr and not asked


def test_damaged_folder_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    result = pyroshock("diagnose", tmp_path / "folder", "--db", f"sqlite:///{tmp_path / 'none.db'}")
    assert result.exit_code == 2 and len(result.stderr.strip().splitlines()) == 1


def test_plate_that_a_user_brings_is_taken(tmp_path: Path) -> None:
    folder, modes = gun_campaign(tmp_path / "folder"), tmp_path / "modes.csv"
    modes.write_text(
        "mode,frequency_hz,damping_ratio,shape_impact,shape_a\n1,400,0.01,0.3,0.4\n",
        encoding="utf-8",
    )
    record = record_of(None, "sqlite:///none.db", DiagnosisRequest(campaign=folder, modes=modes))
    assert record.plate is not None and record.plate.frequency_hz.tolist() == [400.0]


def test_drawing_of_a_plate_is_solved(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        twins, "solved", lambda drawing, material, *_: (drawing.sensors, material.name)
    )
    bench = tmp_path / "bench.toml"
    bench.write_text(
        "[plate]\nmaterial = 'steel'\nsensors = {left = [0.3, 0.3]}\n", encoding="utf-8"
    )
    record = record_of(
        None,
        "sqlite:///none.db",
        DiagnosisRequest(campaign=gun_campaign(tmp_path / "folder"), bench=bench),
    )
    assert record.plate == ({"left": (0.3, 0.3)}, "steel") and not record.plate_points_known


def drawn_campaign(
    folder: Path, rows: Callable[[dict[str, object]], dict[str, object]] = dict
) -> Path:
    """Accelerations on a plate of which the campaign has a drawing and no modal table; `rows` may
    change its rows."""
    plate_campaign(folder, hits=1)
    drawing = (
        'material = "steel"\nthickness_m = 0.012\noutline_m = [[0, 0], [0.5, 0], '
        "[0.5, 0.4], [0, 0.4]]"
    )
    replace_in(folder / "campaign.toml", 'modes = "plate_modes.csv"', drawing)
    with (folder / "runs.csv").open(newline="", encoding="utf-8") as file:
        table = [rows(dict(row)) for row in csv.DictReader(file)]
    write_runs(folder, table)
    return folder


@pytest.mark.parametrize(
    ("struck", "solved"), [(None, "steel"), ("aluminum", "aluminum"), ("steel", "steel")]
)
def test_plate_is_solved_from_the_campaign_s_own_outline(
    tmp_path, monkeypatch, struck: str | None, solved: str
):
    """Of the plate that the runs strike, which are named in the table of runs or else in
    `[bench.plate]`."""
    monkeypatch.setattr(
        twins,
        "solved",
        lambda drawing, material, *_: (drawing.outline_m[2], drawing.thickness_m, material.name),
    )

    def of(row: dict[str, object]) -> dict[str, object]:
        row.pop("plate_material")
        return row if struck is None else {**row, "plate_material": struck}

    record = record_of(
        None,
        "sqlite:///none.db",
        DiagnosisRequest(campaign=drawn_campaign(tmp_path / "folder", of)),
    )
    assert record.plate == ((0.5, 0.4), 0.012, solved) and not record.plate_points_known
    assert record.plate_model_material == solved


def test_plate_s_own_modal_table_is_not_solved(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(twins, "solved", lambda *_: pytest.fail("there is a modal table"))
    record = record_of(
        None,
        "sqlite:///none.db",
        DiagnosisRequest(campaign=plate_campaign(tmp_path / "folder", hits=1).folder),
    )
    assert (
        record.plate is not None
        and record.plate.frequency_hz.size == 6
        and record.plate_points_known
    )


# --- the diagnosis itself, on the three disclosed campaigns ---
DISCLOSED = {
    "gun-valve-flow": "gun.valve_flow",
    "hammer-effective-mass": "contact.effective_mass",
    "plate-damping": "plate.damping",
}


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize("name", DISCLOSED)
def test_disclosed_cause_is_in_the_first_group(
    shared: Path, tmp_path, name: str, monkeypatch
) -> None:
    monkeypatch.chdir(tmp_path)
    page = tmp_path / "gap.html"
    diagnosis = json.loads(
        run_pyroshock("diagnose", shared / "examples" / name, "--json", "--html", page).stdout
    )
    first = diagnosis["causes"][0]
    assert not any("outside of the catalogue" in note for note in diagnosis["assumptions"])
    assert DISCLOSED[name] in first["effects"] and len(first["effects"]) <= 4
    # Of every set, with small second effects or without, in which one of the first entry's effects
    # acts.
    alike = set(first["effects"])
    acts = [
        cause
        for cause in diagnosis["causes"]
        if all(alike & set(names.split("+")) for names in cause["effects"])
    ]
    assert sum(cause["probability"] for cause in acts) >= 0.9
    assert first["probability"] == max(cause["probability"] for cause in diagnosis["causes"])
    assert f"<title>Diagnosis: {name}</title>" in page.read_text(encoding="utf-8")
    assert list(tmp_path.iterdir()) == [page]
