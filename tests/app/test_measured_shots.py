"""Shots read from the store, against what was recorded and sealed; a twin of them, and benches of
files."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from pyroshock.app.operations.tune.session import _levels, _without_double_counting
from pyroshock.app.twins import building as twins
from pyroshock.app.twins.benches import (
    PlateDrawing,
    bench_of_campaign,
    bench_of_file,
    shipped_bench,
)
from pyroshock.app.twins.building import TwinRequest, twin_of
from pyroshock.app.twins.measured_shots import CampaignPlate, read_measured_shots, struck_plate
from pyroshock.app.twins.twin_cache import CacheKeyReader
from pyroshock.dataset.rows import stored_materials
from pyroshock.ingest.storing.stored_channels import list_channels, read_channel
from pyroshock.schema.campaigns import Campaign
from pyroshock.schema.impacts import (
    INTEGRATED,
    TARGET_MOTION_ADDED,
    Impact,
    Pulse,
    Shot,
    velocity_kind,
)
from pyroshock.schema.recordings import QualityFinding
from pyroshock.signals.srs.spectrum import shock_response_spectrum
from pyroshock.twin.contact.prior import PriorContact
from pyroshock.twin.contact.stage import LawContact
from pyroshock.twin.contact_interface import ImpactBatch
from pyroshock.twin.setting import THESIS
from pyroshock.virtualbench.campaigns import ringing
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.simulate import simulate
from sqlalchemy import select
from support.records.twin_parts import unsolved
from support.stores.stores import ingested, opened, run_pyroshock

LINES = np.array([200.0, 500.0, 1250.0])
SENSORS = ("acceleration_1", "acceleration_2")
_LAYERS = {
    "anvil_material": "none",
    "insulator": "none",
    "tip_material": "aluminum",
    "tip_radius_mm": "30",
}
HAMMER_ROWS = [
    {
        "run": "1",
        "impact_position": "#2",
        "hammer_speed": "high",
        **_LAYERS,
        "boundary_conditions": "fixed",
    }
]
GUN_ROWS = [
    {
        "run": str(run),
        "plate_material": plate,
        **_LAYERS,
        "bullet_mass_kg": "0.5",
        "tank_pressure_bar": bar,
    }
    for run, (plate, bar) in enumerate(
        [("aluminum", "0.4"), ("aluminum", "0.6"), ("steel", "0.4")], 1
    )
]


@pytest.fixture(scope="module")
def campaigns(tmp_path_factory):
    """A hammer's recording of three hits, and six shots of a gun on two plates, in one store; modes
    to 0.8 kHz."""
    folder = tmp_path_factory.mktemp("shots")
    url = f"sqlite:///{folder / 'lab.db'}"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ringing, "MAX_FREQUENCY_HZ", 800.0)
        for kind, rows, hits in (("hammer", HAMMER_ROWS, 3), ("gun", GUN_ROWS, 2)):
            simulate(
                rows,
                kind,
                folder / kind,
                seed=5,
                effects=Effects.default(),
                repetitions=hits,
                jobs=1,
            )
            ingested(url, folder / kind)
    return SimpleNamespace(url=url, folder=folder)


@pytest.fixture
def session(campaigns):
    """Of a store in which a test may write: nothing is kept."""
    with opened(campaigns.url) as store, store.writing() as session:
        yield session
        session.rollback()


def read(session, campaign, sensors=SENSORS, **more):
    known, bench = stored_materials(session), bench_of_campaign(session, campaign)
    given = {"plate": struck_plate(bench), "material": lambda name: known[name.lower()]} | more
    return read_measured_shots(
        session, campaign, frequency_hz=LINES, q=10.0, sensors=sensors, **given
    )


def sealed(campaigns, kind):
    seal = json.loads((campaigns.folder / f"{kind}.sealed.json").read_text(encoding="utf-8"))
    return [hit for run in seal["runs"] for hit in run["hits"]]


def test_hits_of_one_recording_are_read_apart_with_the_velocity_before_contact(campaigns, session):
    shots, left_out = read(session, "hammer")
    assert (len(shots), left_out) == (3, ())
    starts = [hit["start_s"] for hit in sealed(campaigns, "hammer")]
    recording = session.scalars(select(Impact.recording_id)).first()
    for column, row in enumerate(r for r in list_channels(session, recording) if r.name in SENSORS):
        record = read_channel(session, row)
        for hit, start in enumerate(starts):
            first = round(start * row.sampling_rate_hz)
            own = record.si[first - 40 : first + round(0.1 * row.sampling_rate_hz)]
            own = own - np.median(own[:35])
            assert shots.peak_acceleration_m_s2[hit, column] == pytest.approx(
                np.abs(own).max(), rel=0.01
            )
            spectrum = shock_response_spectrum(own, row.sampling_rate_hz, LINES).maximax
            assert shots.spectra_m_s2[hit, column] == pytest.approx(spectrum, rel=0.02)
    shots, _ = read(session, "hammer")
    truth = np.array([hit["velocity_m_s"] for hit in sealed(campaigns, "hammer")])
    query = (
        select(Impact.impact_velocity_m_s)
        .where(Impact.velocity_source == "integrated")
        .order_by(Impact.id)
    )
    integrated = np.array(session.scalars(query).all())
    assert np.abs(np.log(shots.impact_velocity_m_s / truth)).max() < 0.12
    assert (
        np.abs(np.log(shots.impact_velocity_m_s / truth)).max()
        < np.abs(np.log(integrated / truth)).min()
    )
    assert np.all(shots.impact_velocity_u_m_s > 0.02 * shots.impact_velocity_m_s)
    (setting,) = {replace(s, impact_velocity_m_s=1.0) for s in shots.settings}
    assert setting.impactor_mass_kg == pytest.approx(0.32)
    assert (setting.impact_position, setting.boundary_conditions) == ("#2", "fixed")
    assert setting.factors == {"hammer_speed": "high"} and len(set(shots.configuration)) == 1


def test_guns_shots_have_pressure_velocity_and_force_and_what_is_unknown_is_told(
    campaigns, session
):
    shots, _ = read(session, "gun")
    truth = sealed(campaigns, "gun")
    assert [s.plate.name for s in shots.settings] == ["aluminum"] * 4 + ["steel"] * 2
    assert [s.tank_pressure_pa for s in shots.settings] == pytest.approx(
        [0.4e5, 0.4e5, 0.6e5, 0.6e5, 0.4e5, 0.4e5]
    )
    assert shots.impact_velocity_m_s == pytest.approx(
        [hit["muzzle_velocity_m_s"] for hit in truth], rel=0.05
    )
    assert shots.peak_force_n == pytest.approx(
        [hit["peak_plate_force_n"] for hit in truth], rel=0.05
    )
    assert shots.settings[-1].plate_mass_kg == pytest.approx(0.345 * 0.01 * 7800, rel=0.01)
    shots, _ = read(session, "gun", most=3)
    assert [s.tank_pressure_pa for s in shots.settings] == pytest.approx([0.4e5, 0.6e5, 0.4e5])
    shots, left_out = read(session, "hammer", ("acceleration_1", "acceleration_9"))
    assert np.isnan(shots.peak_acceleration_m_s2[:, 1]).all()
    assert left_out[0] == "run 1, repetition 1: no channel acceleration_9"
    nothing, plate = {"aluminum": THESIS["aluminum"]}, CampaignPlate("aluminum", 0.01, 0.345)
    shots, left_out = read(session, "gun", plate=plate, material=lambda name: nothing[name])
    assert len(shots) == 4 and left_out == (
        "run 3, repetition 1: 'steel'",
        "run 3, repetition 2: 'steel'",
    )
    with pytest.raises(LookupError, match="no campaign 'autumn'"):
        read(session, "autumn")


def test_what_a_check_rejects_is_left_out(session):
    impact = session.scalars(select(Impact).order_by(Impact.id)).first()
    channel = next(
        row for row in list_channels(session, impact.recording_id) if row.name == SENSORS[1]
    )
    given = {
        "recording_id": impact.recording_id,
        "severity": "reject",
        "message": "",
        "evidence": {},
    }
    session.add(QualityFinding(channel_id=None, impact_id=impact.id, check="saturation", **given))
    session.add(QualityFinding(channel_id=channel.id, impact_id=None, check="zero-shift", **given))
    shot = session.scalars(select(Shot).order_by(Shot.id)).first()
    given["recording_id"] = shot.recording_id
    session.add(
        QualityFinding(channel_id=None, impact_id=shot.impact_id, check="saturation", **given)
    )
    shots, left_out = read(session, "hammer")
    assert (
        len(shots) == 2
        and "run 1, repetition 1: the check saturation (reject) rejects it" in left_out
    )
    assert "run 1, repetition 2: the check zero-shift rejects acceleration_2" in left_out
    assert np.isnan(shots.spectra_m_s2).all(axis=-1).tolist() == [[False, True], [False, True]]
    shots, left_out = read(session, "gun")
    assert left_out == ("run 1, repetition 1: the check saturation (reject) rejects its force",)
    assert math.isnan(shots.peak_force_n[0]) and shots.impact_velocity_m_s[0] > 0


def test_hits_without_mass_have_their_measured_force_or_are_left_out(session):
    """Their force is that of the store, and the setting is what Hertz' law needs for it; no contact
    learns from it."""
    campaign = session.scalars(select(Campaign).where(Campaign.name == "hammer")).one()
    campaign.hammer_id = None
    session.flush()
    shots, left_out = read(session, "hammer")
    assert (len(shots), left_out) == (3, ())
    assert shots.force_is_given.all() and np.isnan(shots.impact_velocity_m_s).all()
    pulses = shots.given_pulses(np.arange(3))
    assert pulses.contact_time_s == pytest.approx(shots.contact_time_s)
    assert pulses.peak_force_n == pytest.approx(shots.peak_force_n, rel=2e-3)
    assert pulses.impulse_n_s == pytest.approx(shots.impulse_n_s, rel=5e-3)
    velocities = np.array([setting.impact_velocity_m_s for setting in shots.settings])
    law = LawContact("hertz").pulses(ImpactBatch(shots.settings, velocities))
    assert law.contact_time_s == pytest.approx(shots.contact_time_s, rel=1e-3)
    assert (
        law.impulse_n_s == pytest.approx(shots.impulse_n_s, rel=1e-3)
        and PriorContact().updated(shots).shots == 0
    )
    plates_there = SimpleNamespace(
        twin=SimpleNamespace(plate=SimpleNamespace(plates={"aluminum": None}))
    )
    levels, others = _levels(shots, plates_there)  # the tuner knows no force
    assert (len(levels), others) == (0, ["no mass or no velocity of the impactor"] * 3)
    session.scalars(select(Campaign).where(Campaign.name == "hammer")).one().hammer_id = None
    for impact in session.scalars(select(Impact).where(Impact.run == 1)):
        session.query(Pulse).filter(Pulse.impact_id == impact.id).update({"current": False})
    session.flush()
    shots, left_out = read(session, "hammer")
    assert (len(shots), len(left_out)) == (0, 3) and left_out[
        0
    ] == "run 1, repetition 1: no mass of the impactor"


# --- a twin of them ---
@pytest.fixture
def built(campaigns, monkeypatch):
    """Twins of the store by their requests, with plates that need no solution."""
    monkeypatch.chdir(campaigns.folder)
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)
    monkeypatch.setattr(twins, "solved", unsolved)
    with opened(campaigns.url) as store:

        def build(campaign="gun", **own):
            request = TwinRequest(campaign=campaign, frequency_hz=tuple(LINES.tolist()), **own)
            return twin_of(store, campaigns.url, request)

        yield build


def test_campaigns_shots_teach_every_stage_but_for_configurations_left_out(built, session):
    twin = built().twin
    assert (len(twin.gun.shots), twin.contact.shots, twin.calibration.shots) == (6, 6, 6)
    assert set(twin.plate.plates) == {"aluminum", "steel"} and twin.rests_on.shots == 6
    assert twin.rests_on.sentence == (
        "The bands rest on 6 measured shots of campaign gun; the contact is the law with yield, "
        "loss and layer updated by them."
    )
    first, *_, last = read(session, "gun")[0].configuration.tolist()
    twin = built(without_configurations=frozenset((first, last))).twin
    assert (len(twin.gun.shots), twin.contact.shots, twin.calibration.shots) == (2, 2, 2)
    assert set(twin.plate.plates) == {"aluminum"}
    of_hammer = built("hammer")
    assert of_hammer.twin.gun is None and of_hammer.bench.impactor_mass_kg == pytest.approx(0.32)
    assert of_hammer.twin.contact.shots == 3
    with pytest.raises(ValueError, match="this twin has no gun: give the impact velocity"):
        of_hammer.twin.predict(
            of_hammer.setting(
                impactor_mass_kg=0.3, tip=of_hammer.plate, tip_radius_m=0.03, tank_pressure_pa=1e5
            )
        )


def test_another_bench_keeps_what_still_applies(built, tmp_path):
    """Another plate: gun and contact learn, spectra do not. Another gun: its velocities are not
    this one's."""
    (tmp_path / "plate.toml").write_text("[plate]\nthickness_m = 0.02\n")
    twin = built(bench=tmp_path / "plate.toml").twin
    assert (len(twin.gun.shots), twin.contact.shots, twin.calibration.shots) == (6, 6, 0)
    gun = (
        "tank_volume_m3 = 0.02\nbore_diameter_m = 0.049\nprojectile_diameter_m = "
        "0.048\ntravel_m = 0.9\n"
    )
    gun += "friction_coefficient = 0.2\nheat_capacity_ratio = 1.4\nefficiency = 1.0\n"
    (tmp_path / "gun.toml").write_text(f"[gun]\n{gun}")
    twin = built(bench=tmp_path / "gun.toml").twin
    assert (twin.gun.shots, twin.contact.shots, twin.calibration.shots) == (None, 6, 6)


def test_twins_say_what_they_rest_on_and_what_lies_beyond_the_shots(built):
    twin = built(learn=False).twin
    assert (twin.gun.shots, twin.contact.shots, twin.calibration.shots) == (None, 0, 0)
    assert twin.rests_on.sentence == (
        "The bands rest on no measured shot of this bench: they show the documented ranges of "
        "yield, loss, plate and layer."
    )
    twin = built(contact="hertz").twin
    assert twin.calibration.shots == 6
    assert twin.rests_on.sentence == (
        "The bands rest on 6 measured shots of campaign gun; the contact is "
        "the law hertz with the error of its table."
    )
    model = built()
    mount = {"impactor_mass_kg": 0.5, "tip": model.material("aluminum"), "tip_radius_m": 0.03}
    inside = model.twin.predict(model.setting(tank_pressure_pa=0.5e5, **mount), draws=8)
    beyond = model.twin.predict(
        model.setting(tank_pressure_pa=4e5, **(mount | {"impactor_mass_kg": 1.0})), draws=8
    )
    assert inside.extrapolation == ()
    asked = {item.quantity: (item.asked, item.low, item.high) for item in beyond.extrapolation}
    assert asked["tank_pressure_pa"] == (4e5, pytest.approx(0.4e5), pytest.approx(0.6e5))
    assert asked["bullet_mass_kg"] == (1.0, 0.5, 0.5)
    assert "impactor_mass_kg" not in asked  # the same mass by its other name
    assert asked["impact_velocity_m_s"][0] > asked["impact_velocity_m_s"][2]
    assert inside.rests_on == model.twin.rests_on


def test_stamps_change_with_pulses(campaigns, built):
    with opened(campaigns.url) as store:
        before = CacheKeyReader(store, campaigns.url).stamp(TwinRequest(contact="hertz"))
        with store.reading() as session:
            newest = session.scalars(select(Pulse).order_by(Pulse.id.desc())).first().id
    assert newest in before[0]


def test_tune_learns_from_a_campaign_once(built, session):
    """Spectra that the tuner is given are not in the twin that it asks as well; on plates that the
    twin has not, they are counted out."""
    model = built()
    assert _without_double_counting(model, ("gun",)).twin.calibration is None
    assert _without_double_counting(model, ("spring",)).twin.calibration is model.twin.calibration
    assert _without_double_counting(built(learn=False), ()).twin.calibration is None
    shots, _ = read(session, "gun", SENSORS[:1])
    measured, others = _levels(shots, model)
    assert (len(measured), others) == (6, [])
    assert measured.level_db == pytest.approx(20 * np.log10(shots.spectra_m_s2[:, 0]))
    alone = replace(
        model, twin=replace(model.twin, calibration=None, plate=built(learn=False).twin.plate)
    )
    measured, others = _levels(shots, alone)
    assert (len(measured), others) == (4, ["no modes of its plate of steel"] * 2)


def test_struck_plate_is_the_drawings_in_either_direction() -> None:
    drawing = PlateDrawing.of([(0, 0), (1, 0), (1, 1), (0, 1)], "square", 0.02)
    bench = SimpleNamespace(plate_material="steel", drawing=drawing)
    assert struck_plate(bench) == CampaignPlate("steel", 0.02, pytest.approx(1.0))
    outline = [(0.0, 0.0), (1.0, 0.0), (1.0, 0.6), (0.0, 0.6)]
    for corners in (outline, outline[::-1]):
        assert PlateDrawing.of(corners, "test").area_m2 == pytest.approx(0.6)


# --- a bench as a TOML file: what is no bench is refused by its key ---
@pytest.mark.parametrize(("text", "said"), [
    ("gun = 5", r"\[gun\] is 5; expected a table"),
    ("plate = []", r"\[plate\] is \[\]; expected a table"),
    ("[plate]\nsensors = [1, 2]", r"points are \[1, 2\]; expected a table of names and places"),
    ("[plate]\noutline_m = []", "expected three corners or more"),
    ("[plate]\noutline_m = [[0, 0], [1, 0]]", "expected three corners or more"),
    ("[plate]\noutline_m = [[0, 0], [1, 0], [2, 0]]", "around an area"),
    ("[plate]\noutline_m = [[0, 0], [1e308, 0], [1e308, 1e308]]", "within 1000 m"),
    ("[plate]\noutline_m = [[0, 0], [nan, 0], [1, 1]]", "within 1000 m"),
    ("a = " + "[" * 5000, "hundreds deep; expected at most 16"),
])  # fmt: skip
def test_what_is_no_bench_is_refused(tmp_path: Path, text: str, said: str) -> None:
    """Each ended in a traceback, or in a plate of NaN."""
    path = tmp_path / "bench.toml"
    path.write_text(text)
    with pytest.raises(ValueError, match=rf"(?s)bench\.toml: .*{said}"):
        bench_of_file(path, shipped_bench())


# --- velocities with the motion of the plate's surface ---
ROWS = [
    {"run": str(run), "impact_position": "#1", "hammer_speed": "high", "tip_material": tip,
    "tip_radius_mm": radius,
     "anvil_material": "none", "insulator": "none", "boundary_conditions": "free"}
    for run, (tip, radius) in enumerate((("aluminum", "30"), ("delrin", "30")), 1)
]  # fmt: skip


@pytest.fixture(scope="module")
def bare_plate_campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("virtual") / "hammer"
    simulate(
        ROWS,
        "hammer",
        folder,
        seed=3,
        effects=Effects.default(),
        repetitions=3,
        jobs=1,
        name="hammer",
    )
    return folder


def velocities(
    bare_plate_campaign: Path, url: str, *words: str
) -> tuple[set[str | None], np.ndarray, np.ndarray]:
    """Kinds, velocities and standard uncertainties by run and repetition."""
    run_pyroshock("ingest", bare_plate_campaign, "--db", url, *words)
    with opened(url) as store, store.reading() as session:
        impacts = session.scalars(select(Impact).order_by(Impact.run, Impact.repetition)).all()
        figures = np.array(
            [(impact.impact_velocity_m_s, impact.impact_velocity_u_m_s) for impact in impacts]
        )
        return {velocity_kind(impact.velocity_source) for impact in impacts}, *figures.T


def test_velocity_is_nearer_to_the_true_one(bare_plate_campaign: Path, tmp_path: Path) -> None:
    """Struck bare, the plate gives way: the thesis's integral is less than six tenths of the true
    velocity."""
    seal = json.loads(bare_plate_campaign.with_name("hammer.sealed.json").read_text())
    truth = np.array([hit["velocity_m_s"] for run in seal["runs"] for hit in run["hits"]])
    kinds, integrated, _ = velocities(bare_plate_campaign, f"sqlite:///{tmp_path / 'thesis.db'}")
    assert kinds == {INTEGRATED} and np.all(integrated < 0.6 * truth)
    plate = ("--velocity-target-motion", "plate")
    kinds, corrected, uncertainty = velocities(
        bare_plate_campaign, f"sqlite:///{tmp_path / 'plate.db'}", *plate
    )
    assert kinds == {TARGET_MOTION_ADDED} and np.all(np.abs(corrected / truth - 1) < 0.2)
    assert np.all(np.abs(corrected - truth) < 2 * uncertainty)
