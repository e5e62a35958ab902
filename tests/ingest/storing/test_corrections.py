"""Facts of a stored campaign are added and corrected with a reason: the earlier value is kept, and
what was made before keeps what it was made with."""

from __future__ import annotations

from pathlib import Path

import pytest
from pyroshock.dataset.predictors import shipped
from pyroshock.dataset.selection import missing_in_campaigns
from pyroshock.dataset.snapshot import build_snapshot, read_snapshot
from pyroshock.ingest.errors import IngestError
from pyroshock.ingest.load import ingest_folder
from pyroshock.ingest.storing.corrections import correct_facts
from pyroshock.schema.campaigns import Campaign
from pyroshock.schema.corrected_facts import corrections_since_dataset, list_corrections
from pyroshock.schema.impacts import Shot
from pyroshock.schema.session import Store
from sqlalchemy import select
from support.records.campaigns import (
    gun_campaign,
    hammer_campaign,
    hammer_rows,
    replace_in,
    write_runs,
)
from support.stores.stores import opened, run_pyroshock

PLATE = """
[bench.plate]
material = "steel"
thickness_m = 0.01
"""


@pytest.fixture
def url(tmp_path: Path) -> str:
    return f"sqlite:///{tmp_path / 'lab.db'}"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A hammer's campaign on a plate."""
    made = hammer_campaign(tmp_path / "spring", 3, 2, "spring")
    with (made / "campaign.toml").open("a", encoding="utf-8") as file:
        file.write(PLATE)
    return made


def corrected(store: Store, facts: dict[str, str], *runs: int, missing: bool = False):
    return store.write(
        lambda session: correct_facts(
            store, session, "spring", facts, "measured anew", runs, only_missing=missing
        )
    )


def levels(store: Store, factor: str) -> dict[int, str | float | None]:
    with store.reading() as session:
        from pyroshock.schema.configurations import configuration_factors
        from pyroshock.schema.impacts import Impact

        rows = session.execute(select(Impact.run, Impact.configuration_id)).all()
        factors = configuration_factors(session, [key for _, key in rows])
        return {run: factors[key].get(factor) for run, key in rows}


def test_a_fact_of_the_bench_is_corrected_and_the_earlier_one_is_kept(
    url: str, folder: Path
) -> None:
    with opened(url, create=True) as store:
        ingest_folder(store, folder)
        (change,) = corrected(store, {"bench.plate.thickness_m": "12 mm"})
        assert (change.earlier, change.value) == ((("0.01", ()),), "0.012")
        with store.reading() as session:
            row = session.scalars(select(Campaign)).one()
            assert row.plate is not None and row.plate.thickness_m == 0.012
            (correction,) = list_corrections(session, ["spring"])
        assert (
            correction.earlier_words == "0.01"
            and correction.reason == "measured anew"
            and correction.by
        )
        assert "corrected from 0.01 to 0.012" in correction.words
        assert corrected(store, {"bench.plate.thickness_m": "0.012"}) == ()  # says the same
    run_pyroshock("db", "check", "--db", url)


def test_a_folder_with_the_earlier_value_is_refused_and_one_with_the_new_value_grows(
    url: str, folder: Path
) -> None:
    with opened(url, create=True) as store:
        ingest_folder(store, folder)
        corrected(store, {"bench.plate.thickness_m": "0.012", "bench.hammer.mass_kg": "330 g"})
        with pytest.raises(IngestError, match=r"0\.01, 0\.012 in the store.*measured anew"):
            ingest_folder(store, folder)
        replace_in(folder / "campaign.toml", "thickness_m = 0.01", "thickness_m = 0.012")
        replace_in(folder / "campaign.toml", "mass_kg = 0.32", "mass_kg = 0.33")
        assert not ingest_folder(store, folder).added["impacts"]


def test_a_part_of_the_bench_that_was_missing_is_added(url: str, tmp_path: Path) -> None:
    made = hammer_campaign(tmp_path / "bare", 1, 1, "spring")
    replace_in(made / "campaign.toml", "[bench.hammer]\nmass_kg = 0.32\n", "")
    with opened(url, create=True) as store:
        ingest_folder(store, made)
        with pytest.raises(IngestError, match=r"bench\.plate"):
            corrected(store, {"bench.plate.thickness_m": "10 mm"})  # without a material
        changes = corrected(
            store,
            {
                "bench.hammer.mass_kg": "0.32",
                "bench.plate.thickness_m": "10 mm",
                "bench.plate.material": "Steel",
            },
        )
        assert {change.fact for change in changes} == {
            "bench.hammer.mass_kg", "bench.plate.thickness_m", "bench.plate.material",
        }  # fmt: skip
        assert all(change.earlier == ((None, ()),) for change in changes)
        replace_in(
            made / "campaign.toml",
            "[channels.force]",
            f"[bench.hammer]\nmass_kg = 0.32\n{PLATE}\n[channels.force]",
        )
        ingest_folder(store, made)  # the folder that says the same is the same campaign


def test_factors_of_runs_are_corrected_and_added(url: str, folder: Path) -> None:
    with opened(url, create=True) as store:
        ingest_folder(store, folder)
        levels_before = levels(store, "tip_radius")
        (change,) = corrected(store, {"tip_radius_mm": "45"}, 2)
        assert change.value == "45" and change.earlier == (("15", ((2, 1), (2, 2))),)
        assert levels(store, "tip_radius") == {**levels_before, 2: 0.045}
        (added,) = corrected(store, {"boundary_conditions": "fixed"}, missing=True)
        assert added.earlier[0][0] is None and len(added.earlier[0][1]) == 6
        assert set(levels(store, "boundary_conditions").values()) == {"fixed"}
        # those that state it stay where only missing ones are filled in
        assert corrected(store, {"tip_radius_mm": "60"}, missing=True) == ()
    run_pyroshock("db", "check", "--db", url)


def test_missing_facts_are_gone_once_they_are_added(url: str, tmp_path: Path) -> None:
    made = hammer_campaign(tmp_path / "bare", 2, 2, "spring")
    text = (made / "runs.csv").read_text(encoding="utf-8").splitlines()
    without = [",".join(row.split(",")[:3] + row.split(",")[4:]) for row in text]
    (made / "runs.csv").write_text("\n".join(without) + "\n", encoding="utf-8")
    with opened(url, create=True) as store:
        ingest_folder(store, made)
        with store.reading() as session:
            missing = missing_in_campaigns(session, ["spring"], shipped("hammer"))
        assert any("tip_radius" in str(name) for name in missing)
        corrected(store, {"tip_radius_mm": "30 mm"})
        with store.reading() as session:
            missing = missing_in_campaigns(session, ["spring"], shipped("hammer"))
        assert not any("tip_radius" in str(name) for name in missing)


def test_a_dataset_keeps_its_facts_and_says_that_they_were_corrected(
    url: str, tmp_path: Path
) -> None:
    made = hammer_campaign(tmp_path / "spring", 3, 2, "spring")
    write_runs(made, [{**row, "impact_velocity_m_s": 1.5} for row in hammer_rows(3, 2)])
    with opened(url, create=True) as store:
        ingest_folder(store, made)
        for name, text in (
            ("plate_material", "steel"), ("anvil_material", "none"), ("insulator", "none"),
            ("boundary_conditions", "free"), ("impact_position", "centre"),
        ):  # fmt: skip
            corrected(store, {name: text})
        corrected(store, {"bench.plate.material": "steel", "bench.plate.thickness_m": "10 mm"})
        built = build_snapshot(store, "first", ["spring"]).snapshot
        with store.reading() as session:
            assert corrections_since_dataset(session, "first") == []
        corrected(store, {"tip_radius_mm": "45"}, 2)
        corrected(store, {"bench.hammer.mass_kg": "0.4"})
        second_snapshot = read_snapshot(store, "first")
        assert second_snapshot.hash == built.hash
        with store.reading() as session:
            words = [item.words for item in corrections_since_dataset(session, "first")]
        assert len(words) == 2 and "tip_radius_mm" in words[1] and "hammer.mass_kg" in words[0]
        newer = build_snapshot(store, "second", ["spring"]).snapshot
        assert newer.hash != built.hash
        with store.reading() as session:
            assert corrections_since_dataset(session, "second") == []


def test_mass_and_pressure_of_shots_are_corrected_with_their_configuration(
    url: str, tmp_path: Path
) -> None:
    with opened(url, create=True) as store:
        ingest_folder(store, gun_campaign(tmp_path / "shots", 3, "spring"))
        corrected(store, {"bullet_mass_kg": "150 g", "tank_pressure_bar": "0.5"}, 2)
        with store.reading() as session:
            rows = {
                run: (mass, pressure)
                for run, mass, pressure in session.execute(
                    select(Shot.run, Shot.bullet_mass_kg, Shot.tank_pressure_pa)
                )
            }
        assert rows[2] == (0.15, 5e4) and rows[1][0] == 0.1428
    run_pyroshock("db", "check", "--db", url)


@pytest.mark.parametrize(("facts", "words"), [
    ({"bench.plate.thickness": "1"}, "is no fact of the campaign; known:"),
    ({"measured_velocity_m_s": "10"}, "replace the recording"),
    ({"tip_radius_mm": "wide"}, "a number above zero"),
    ({"tip_radius_mm": "30 kg"}, "a number above zero"),
    ({"tip_material": "cheese"}, "a material of the store"),
    ({"bench.plate.material": "cheese"}, "a material of the store"),
    ({"bench.hammer.mass_kg": "-1"}, "a number above zero"),
    ({"campaign.date": "yesterday"}, "an ISO date"),
])  # fmt: skip
def test_what_cannot_be_is_refused_and_nothing_is_changed(
    url: str, folder: Path, facts: dict[str, str], words: str
) -> None:
    with opened(url, create=True) as store:
        ingest_folder(store, folder)
        with pytest.raises(IngestError, match=words):
            corrected(store, {"tip_radius_mm": "31", **facts})
        with store.reading() as session:
            assert list_corrections(session, ["spring"]) == []
        assert 0.031 not in levels(store, "tip_radius").values()


def test_an_unknown_run_is_refused(url: str, folder: Path) -> None:
    with opened(url, create=True) as store:
        ingest_folder(store, folder)
        with pytest.raises(LookupError, match="no run 9"):
            corrected(store, {"tip_radius_mm": "31"}, 9)
