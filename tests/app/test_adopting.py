"""Adopted effects: versions of the twin that predictions take up, and the way back."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from pyroshock.app.operations.diagnose import diagnosing
from pyroshock.app.operations.tune import session as tuning_session
from pyroshock.app.operations.validate.report import validation_document
from pyroshock.app.operations.validate.request import ValidationRequest
from pyroshock.app.operations.validate.validation import (
    adopted_lines,
    run_validation,
)
from pyroshock.app.twins import adopted_effects, learning
from pyroshock.app.twins import building as twins
from pyroshock.app.twins.adopted_effects import (
    acts_at,
    adopt,
    adoptable_names,
    adopted_for,
    adoption,
    configuration_name,
    effects_in_use,
    fitted,
    gun_choices_in_use,
    offered,
)
from pyroshock.app.twins.building import TwinRequest
from pyroshock.diagnosis.verdict import (
    AveragedEffects,
    Cause,
    EffectSet,
    EffectShare,
    PathStep,
    Verdict,
    WeightedEffects,
)
from pyroshock.schema.session import Store
from pyroshock.training.registry.records import DatasetName
from pyroshock.twin.contact.stage import LawContact
from pyroshock.twin.effects import Effect, catalogue, effect
from sqlalchemy import func
from support.records import verdicts
from support.records.campaigns import GUN_TOML, gun_campaign, hammer_campaign
from support.stores.stores import ingested, opened, pyroshock, run_pyroshock

VALVE = effect("gun.valve_flow")
GAIN = effect("sensor.velocity_gain", gain=1.05)


def of_gun(campaign: str, *effects: Effect, simulator: str = "gun:adiabatic") -> Verdict:
    return verdicts.verdict(
        campaign=campaign, simulator=simulator, fits={each.id: (each,) for each in effects}
    )


@pytest.fixture(scope="module")
def filled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two campaigns of one gun, and one of another."""
    place = tmp_path_factory.mktemp("filled")
    folders = [gun_campaign(place / name, name=name) for name in ("spring", "summer", "other")]
    toml = GUN_TOML.format(name="other").replace("travel_m = 0.9", "travel_m = 0.8")
    (folders[2] / "campaign.toml").write_text(toml, encoding="utf-8")
    ingested(f"sqlite:///{place / 'lab.db'}", *folders, hammer_campaign(place / "hammer", 1, 1))
    return place / "lab.db"


@pytest.fixture
def lab(filled: Path, tmp_path: Path) -> str:
    return f"sqlite:///{shutil.copy(filled, tmp_path)}"


@pytest.fixture
def store(lab: str) -> Iterator[Store]:
    with opened(lab) as store:
        yield store


def used(store: Store, campaign: str) -> list[str]:
    with store.reading() as session:
        return [acting_effect.id for acting_effect in effects_in_use(session, campaign)[0]]


def test_campaigns_of_the_same_gun_use_it_and_two_are_adopted_together(store: Store) -> None:
    adopt(store, of_gun("spring", VALVE), VALVE.id)
    assert used(store, "spring") == used(store, "summer") == [VALVE.id]
    assert used(store, "other") == used(store, "hammer") == []
    both = of_gun("spring")
    adopt(store, replace(both, fits={"gun.valve_flow+sensor.velocity_gain": (VALVE, GAIN)}),
          "gun.valve_flow+sensor.velocity_gain")  # fmt: skip
    assert used(store, "spring") == [VALVE.id, GAIN.id]


def test_newest_version_counts_alone_and_none_is_the_way_back(store: Store) -> None:
    adopt(store, of_gun("spring", VALVE), VALVE.id)
    with store.reading() as session:  # an effect by hand goes before
        assert effects_in_use(session, "spring", (VALVE,)) == ((), ())
    assert adopt(store, of_gun("summer", GAIN), GAIN.id).version == 2 and used(store, "spring") == [
        GAIN.id
    ]
    adopt(store, of_gun("spring"), "none")
    assert used(store, "spring") == []


def test_numbers_come_back_as_they_were_and_unseen_stages_keep_their_effect(store: Store) -> None:
    row = adopt(store, of_gun("spring", GAIN), GAIN.id)
    source = {"kind": "fitted", "where": "diagnosis of spring"}
    assert row.configuration["sources"] == dict.fromkeys(
        ("sensor.velocity_gain.gain", "sensor.velocity_gain.growth"), source
    )
    with store.reading() as session:
        (found,) = adopted_for(session, "spring")
    assert found.effects == (GAIN,) and found.note.startswith(
        "with sensor.velocity_gain (adopted 2"
    )
    assert "version 1, diagnosis of spring). The diagnosis did not measure" in found.note
    layer = verdicts.LAYER
    adopt(store, of_gun("spring", layer, simulator="gun:adiabatic | contact:hertz"), layer.id)
    adopt(store, of_gun("summer", VALVE), VALVE.id)
    assert used(store, "spring") == [VALVE.id, layer.id]


def test_likeliest_of_a_group_was_fitted_and_its_own_fit_goes_before_a_larger_sets() -> None:
    effects, probability = fitted(replace(verdicts.verdict(), fits={}), "contact.layer_compliance")
    assert effects == (verdicts.LAYER,) and probability == pytest.approx(0.8 * 0.93)
    joint = "gun.valve_flow+gun.back_pressure+gun.blow_by"
    only = replace(verdicts.gun(), fits={joint: JOINT}, causes=(verdicts.gun().causes[0],))
    assert fitted(only, "gun.valve_flow+gun.back_pressure") == (JOINT[:2], None)
    alone = effect("gun.valve_flow", loss_coefficient=40.0)
    made = replace(verdicts.gun(), fits={**verdicts.gun().fits, "gun.valve_flow": (alone,)})
    assert fitted(made, "gun.valve_flow")[0] == (alone,)
    with pytest.raises(
        LookupError, match=r"has: gun.valve_flow,gun.back_pressure,gun.blow_by; gun.valve_flow,gun"
    ):
        fitted(verdicts.gun(), "gun.back_pressure+gun.blow_by")


JOINT = (verdicts.VALVE, verdicts.ATMOSPHERE, verdicts.LEAK)


@pytest.mark.parametrize(("wanted", "effects", "probability"), [
    ("gun.valve_flow+gun.back_pressure+gun.blow_by", JOINT, 0.93),
    ("gun.blow_by + gun.valve_flow+gun.back_pressure", JOINT, 0.93),
    ("gun.valve_flow+gun.back_pressure", JOINT[:2], 0.05),
    ("gun.valve_flow", JOINT[:1], 0.99),
    ("gun.blow_by", JOINT[2:], 0.95),
])  # fmt: skip
def test_sets_and_single_effects_of_a_fit_can_be_adopted(wanted, effects, probability) -> None:
    assert fitted(verdicts.gun(), wanted) == (effects, pytest.approx(probability))


@pytest.mark.parametrize("wanted", ["contact.plate_compliance", "gun.magic", "unknown"])
def test_what_was_not_fitted_is_refused(wanted: str) -> None:
    with pytest.raises(
        LookupError, match=r"no fit of .*; it has: contact.layer_compliance; gun.valve_flow; none"
    ):
        fitted(verdicts.verdict(), wanted)


BORE = effect("gun.barrel_loss", drag_coefficient=3.0)


def of_set(
    *choices: WeightedEffects, campaign: str = "spring", after: float | None = 0.05
) -> Verdict:
    """Valve or bore, which its runs cannot tell apart, and what its choices leave of an error of
    0.42."""
    names = ("gun.barrel_loss", "gun.valve_flow")
    members = tuple(EffectShare(name, 0.5, 0.45, (0.0, 1.0), 0.8, 1, named=True) for name in names)
    return verdicts.gun(
        campaign=campaign,
        causes=(Cause(names, 0.9, (), (0.53, 0.47)), Cause(("none",), 0.1)),
        effects=members,
        sets=(EffectSet(names, 0.98, 0.9, (0.8, 1.0), 0.85),),
        path=(PathStep(" or ".join(names), 0.05, 0.9),),
        averaged=AveragedEffects(choices, after),
        fits={"gun.barrel_loss": (BORE,), "gun.valve_flow": (VALVE,)},
    )


BOTH = (WeightedEffects(0.6, (BORE,), 0.07), WeightedEffects(0.4, (VALVE,), 0.06))
MEAN = "gun.barrel_loss/gun.valve_flow"


def test_mean_of_a_set_is_offered_and_one_of_its_effects_too() -> None:
    verdict = of_set(*BOTH)
    best = offered(verdict)
    assert best is not None and (best.name, best.is_averaged, best.after) == (MEAN, True, 0.05)
    assert best.probability == 0.98 and best.gun_choices == ((0.6, (BORE,)), (0.4, (VALVE,)))
    for wanted in (MEAN, "gun.valve_flow/gun.barrel_loss"):
        assert adoption(verdict, wanted) == best
    single = adoption(verdict, "gun.valve_flow")
    assert (single.effects, single.after, single.is_averaged) == ((VALVE,), 0.06, False)
    assert adoptable_names(verdict) == [MEAN, "gun.barrel_loss", "gun.valve_flow"]
    with pytest.raises(LookupError, match=r"has no fit of 'gun\.valve_flow/gun\.blow_by'"):
        adoption(verdict, "gun.valve_flow/gun.blow_by")


def test_effects_of_sensors_are_not_averaged_but_the_best_predictor_is_offered() -> None:
    choices = (WeightedEffects(0.6, (VALVE,), 0.07), WeightedEffects(0.4, (GAIN,), 0.06))
    best = offered(of_set(*choices))
    assert best is not None and (best.name, best.effects, best.after) == (GAIN.id, (GAIN,), 0.06)
    assert best.reason == "which predicts best on configurations that the fit has not seen"


def test_fit_that_no_part_has_is_refused_and_not_listed(store: Store) -> None:
    wild = effect("gun.barrel_loss", drag_coefficient=21.7)
    verdict = replace(
        of_set(replace(BOTH[1], weight=1.0)),
        fits={"gun.barrel_loss": (wild,), "gun.valve_flow": (VALVE,)},
    )
    assert adoptable_names(verdict) == ["gun.valve_flow"]
    with pytest.raises(
        ValueError,
        match=r"gun.barrel_loss is not adopted: drag_coefficient = 21.7 lies beyond its range",
    ):
        adopt(store, verdict, "gun.barrel_loss")
    assert used(store, "spring") == []
    nothing = replace(verdict, averaged=None)
    assert offered(nothing) is None and adoptable_names(nothing) == ["gun.valve_flow"]


def test_effect_whose_error_was_not_measured_says_so(store: Store) -> None:
    verdict = of_set(*BOTH)
    assert "gun.blow_by" not in {name for step in verdict.path for name in step.effects}
    adopt(
        store,
        replace(verdict, fits={**verdict.fits, "gun.blow_by": (verdicts.LEAK,)}),
        "gun.blow_by",
    )
    with store.reading() as session:
        (version,) = adopted_for(session, "spring")
    assert version.error is None
    assert version.note.endswith(
        "did not measure the model error with these effects on "
        "configurations that the fit had not seen"
    )
    assert version.sentence.endswith("had not seen.")


@pytest.mark.usefixtures("quick_twins")
def test_mean_is_kept_and_predicts_between_its_effects(store: Store, lab: str) -> None:
    row = adopt(store, of_set(*BOTH), MEAN)
    assert configuration_name(row.configuration) == "the mean of gun.barrel_loss and gun.valve_flow"
    with store.reading() as session:
        (found,) = adopted_for(session, "summer")
        assert gun_choices_in_use(session, "spring") == ((0.6, (BORE,)), (0.4, (VALVE,)))
        assert gun_choices_in_use(session, "spring", (verdicts.LEAK,)) == ()
    assert found.effects == (BORE,) and found.gun_choices == ((0.6, (BORE,)), (0.4, (VALVE,)))
    assert found.note.startswith("with the mean of gun.barrel_loss and gun.valve_flow (adopted 2")
    error = "the model error was 42 times the tolerance without and 5 times with what was adopted"
    assert found.note.endswith(f"On configurations that the fit had not seen, {error}")

    def velocity(**given: object) -> float:
        built = twins.twin_of(
            store, lab, TwinRequest(campaign="spring", contact="hertz", learn=False, **given)
        )
        tip = {"tip": built.material("steel"), "tip_radius_m": 0.03}
        shot = built.setting(tank_pressure_pa=5e5, impactor_mass_kg=0.5, **tip)
        return float(built.twin.velocities([shot])[0])

    mean = velocity()
    parts = [velocity(effects=(own,), adopted=False) for own in (BORE, VALVE)]
    assert mean == pytest.approx(0.6 * parts[0] + 0.4 * parts[1], rel=1e-9)
    assert abs(parts[0] - parts[1]) > 0.01 * mean
    # An effect of the gun by hand goes before the mean, and none goes back.
    assert velocity(effects=(BORE,)) != pytest.approx(mean, rel=1e-3)
    adopt(store, of_set(*BOTH), "none")
    assert velocity() == velocity(adopted=False)


@pytest.mark.usefixtures("quick_twins")
def test_validation_shows_the_errors_without_and_with_what_was_adopted(
    store: Store, lab: str
) -> None:
    request = ValidationRequest(campaign="spring", folds=2, draws=20, contact="hertz")
    assert run_validation(store, lab, request).as_json()["adopted"] is None
    adopt(store, of_set(*BOTH), MEAN)
    data = run_validation(store, lab, request).as_json()
    (row,) = [row for row in data["adopted"]["errors"] if row["name"] == "velocity"]
    score = next(score for score in data["quantities"] if score["name"] == "velocity")
    assert row["without"] == score["median_abs_error"] and row["with"] != row["without"]
    lines = adopted_lines(data)
    assert lines[0].startswith(
        "Version 1, from the diagnosis of spring, has the mean of gun.barrel_loss and gun.valve"
    )
    assert "5 times with what was adopted." in lines[0] and lines[-1].startswith(
        "The effects were fitted to these shots"
    )
    assert any(line.startswith("Impact velocity: median error") for line in lines)
    of_summer = run_validation(
        store, lab, request.model_copy(update={"campaign": "summer"})
    ).as_json()
    assert not of_summer["adopted"]["fitted_to_these_shots"]
    assert "With the adopted effects" in [
        section.title for section in validation_document(data).sections
    ]


def test_two_at_once_keep_both(database_url: str, tmp_path: Path) -> None:
    """Each in a store of its own, as two commands are."""
    ingested(database_url, gun_campaign(tmp_path / "spring", name="spring"))

    def one(_: int) -> int:
        with opened(database_url) as store:
            return adopt(store, of_gun("spring", VALVE), VALVE.id).version

    with ThreadPoolExecutor(4) as pool:
        assert sorted(pool.map(one, range(8))) == list(range(1, 9))


def test_number_that_was_taken_meanwhile_is_tried_anew(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    """PostgreSQL lets two commands read the same newest number; the second one's commit is
    refused."""
    adopt(store, of_gun("spring", VALVE), VALVE.id)
    honest, calls = adopted_effects._add, []

    def late(session, campaign, configuration, reason, diagnosis):
        calls.append(reason)
        if len(calls) == 1:
            monkeypatch.setattr(func, "max", lambda column: column - column)
        else:
            monkeypatch.undo()
        return honest(session, campaign, configuration, reason, diagnosis)

    monkeypatch.setattr(adopted_effects, "_add", late)
    assert adopt(store, of_gun("spring", GAIN), GAIN.id).version == 2


def test_every_effect_acts_at_a_stage_and_a_sensor_s_at_what_it_reads() -> None:
    for identity in catalogue():
        stage = acts_at(identity)
        assert stage in adopted_effects.STAGES and identity.startswith(("sensor.", f"{stage}."))
    stages = {
        "pressure_gain": "gun",
        "velocity_gain": "gun",
        "force_bandwidth": "contact",
        "zero_shift": "plate",
    }
    assert {name: acts_at(f"sensor.{name}") for name in stages} == stages


@pytest.mark.usefixtures("quick_twins")
def test_adopted_effect_changes_what_is_predicted(
    lab: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The way round: diagnose --adopt, predict, predict --no-adopted, --adopt none."""
    shot = ("predict", "--tank-pressure", "5bar", "--campaign", "spring", "--contact", "hertz",
    "--draws", "4",
            "--frequencies", "200:800:3", "--db", lab, "--json")  # fmt: skip

    def velocity(*more: str) -> tuple[float, str]:
        result = run_pyroshock(*shot, *more)
        return json.loads(result.stdout)["velocity_m_s"]["mean"], result.stderr

    nominal, _ = velocity()
    found = of_gun("spring", VALVE)
    monkeypatch.setattr(diagnosing, "run_diagnosis", lambda *_, **__: found)
    told = pyroshock("diagnose", "spring", "--db", lab, "--adopt", VALVE.id)
    assert (
        told.exit_code == 0
        and "adopted as version 1: diagnosis of spring: gun.valve_flow" in told.stderr
    )
    adopted, notes = velocity()
    assert adopted != pytest.approx(nominal, rel=0.01)
    assert "with gun.valve_flow (adopted 2" in notes and "diagnosis of spring)" in notes
    assert velocity("--no-adopted")[0] == nominal
    back = pyroshock("diagnose", "spring", "--db", lab, "--adopt", "none")
    assert back.exit_code == 0
    assert (
        "nothing is adopted from version 2 on: predict and tune use the nominal gun" in back.stderr
    )
    assert (
        "adopted as" not in back.stderr
        and "says first" not in back.stderr
        and velocity()[0] == nominal
    )


@pytest.mark.usefixtures("quick_twins")
def test_bench_of_a_file_is_another_one(lab: str, tmp_path: Path) -> None:
    with opened(lab) as store:
        adopt(store, of_gun("spring", VALVE), VALVE.id)
    (tmp_path / "bench.toml").write_text("[plate]\nthickness_m = 0.012\n", encoding="utf-8")
    result = pyroshock("predict", "--campaign", "spring", "--bench", "bench.toml", "--contact",
    "hertz",
                       "--draws", "4", "--frequencies", "200:800:3", "--db", lab)  # fmt: skip
    assert result.exit_code == 0 and "adopted" not in result.stderr


def test_unknown_effect_is_one_line_and_one_that_is_not_first_is_told(
    lab: str, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(diagnosing, "run_diagnosis", lambda *_, **__: of_gun("spring", VALVE))
    result = pyroshock("diagnose", "spring", "--db", lab, "--adopt", "gun.magic")
    assert (
        result.exit_code == 2
        and "has no fit of 'gun.magic'" in result.stderr.strip().splitlines()[-1]
    )
    result = pyroshock("diagnose", "spring", "--db", lab, "--adopt", VALVE.id)
    assert (
        "gun.valve_flow is not what the diagnosis says first: contact.layer_compliance"
        in result.stderr
    )


@pytest.mark.usefixtures("quick_twins")
def test_registered_model_and_another_plate_keep_their_law(
    lab: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    layer = verdicts.LAYER
    with opened(lab) as store:
        adopt(store, of_gun("spring", layer, simulator="gun:adiabatic | contact:hertz"), layer.id)

        class Registry:
            def versions(self) -> list[SimpleNamespace]:
                dataset = DatasetName("spring", "0" * 64, "gun")
                return [
                    SimpleNamespace(
                        label="hybrid@1", champion_of="gun", promoted_at="2026", dataset=dataset
                    )
                ]

        monkeypatch.setattr(twins, "_registry", lambda _: Registry())
        monkeypatch.setattr(twins, "_registered", lambda *_: LawContact("hunter"))
        by_model = twins.twin_of(store, lab, TwinRequest(campaign="spring"))
        by_law = twins.twin_of(store, lab, TwinRequest(campaign="spring", contact="hertz"))
    assert by_model.twin.contact.label == "hunter"
    assert any(
        "does not act on hybrid@1, which has learned it from measured" in note
        for note in by_model.notes
    )
    assert by_law.twin.contact.label == f"hertz + {layer.id}"
    damping = effect("plate.damping", factor=2.0)
    with opened(lab) as store:
        adopt(store, of_gun("spring", damping, simulator="plate:modal"), damping.id)
        own = twins.twin_of(store, lab, TwinRequest(campaign="spring", contact="hertz"))
        other = twins.twin_of(
            store, lab, TwinRequest(campaign="spring", contact="hertz", plate="steel")
        )
    assert own.twin.plate.effects == (damping,) and other.twin.plate.effects == ()


@pytest.mark.usefixtures("quick_twins")
def test_model_of_another_bench_has_not_learned_it(
    lab: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Explicit effects act on any model; adopted ones on a model whose pulses are of another
    gun."""
    layer, given = verdicts.LAYER, effect("contact.effective_mass")
    with opened(lab) as store:
        adopt(store, of_gun("spring", layer, simulator="gun:adiabatic | contact:hertz"), layer.id)
        version = SimpleNamespace(label="hybrid@1", champion_of="gun", promoted_at="2026",
                                  dataset=DatasetName("spring", "0" * 64, "gun", "gun",
                                  "before contact"))  # fmt: skip
        monkeypatch.setattr(
            twins, "_registry", lambda _: SimpleNamespace(versions=lambda: [version])
        )
        monkeypatch.setattr(
            twins, "_registered", lambda *given: LawContact("hertz", effects=given[-1])
        )
        for taught, expected in (
            ("other", (given, layer)),
            ("summer", (given,)),
            ("spring", (given,)),
        ):
            monkeypatch.setattr(learning, "training_campaigns", lambda *_, name=taught: (name,))
            built = twins.twin_of(store, lab, TwinRequest(campaign="spring", effects=(given,)))
            assert getattr(built.twin.contact, "effects") == expected  # noqa: B009


def test_tune_leaves_it_out_where_asked(
    lab: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    asked = []

    def stop(_store, _db, _target, _search, twin):
        asked.append(twin.adopted)
        raise ValueError("enough")

    monkeypatch.setattr(tuning_session, "session_of", stop)
    (tmp_path / "spec.csv").write_text("frequency_hz,level_g\n100,10\n1000,100\n", encoding="utf-8")
    for more in ((), ("--no-adopted",)):
        assert (
            "enough"
            in pyroshock("tune", "--target", tmp_path / "spec.csv", "--db", lab, *more).stderr
        )
    assert asked == [True, False]
