"""A store on another engine is the same store, or is not there."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from pyroshock.schema.benches import Material
from pyroshock.schema.diagnoses import Diagnosis
from pyroshock.schema.engine import StoreError, make_engine
from pyroshock.schema.home_pictures import HomePictureRow
from pyroshock.schema.saved_views import SavedView
from pyroshock.schema.tables import metadata
from sqlalchemy import func, inspect, select, text
from support.stores.care_stores import WHEN, copied, execute, registered_version
from support.stores.hammer_stores import url_of
from support.stores.people_rows import add_people_rows
from support.stores.stores import content, opened

TESTS = Path(__file__).resolve().parents[2]


def test_round_trip_over_the_other_engine_changes_nothing(care_copy, database_url, tmp_path):
    with opened(care_copy) as store, store.writing() as session:
        session.add(registered_version())
        session.add(SavedView(name="force", request={"y": "peak_force_n"}, saved_at=WHEN))
        session.add(HomePictureRow(picture="runs-by-plan", position=1))
        add_people_rows(session, "spring")
    there = copied(care_copy, database_url)
    back = copied(database_url, url_of(tmp_path / "back.db"))
    assert there == back
    assert {table.name for table in there if table.rows} == set(metadata.tables)
    assert content(url_of(tmp_path / "back.db")) == content(care_copy)
    assert_same_values(care_copy, database_url)
    assert_next_key_is_free(database_url)


def assert_same_values(one_url, other_url):
    """What engines write differently: NaN within JSON, NULL beside JSON's null, times."""
    with (
        opened(one_url) as here,
        opened(other_url) as there,
        here.reading() as a,
        there.reading() as b,
    ):
        one, other = (session.scalars(select(Diagnosis)).one() for session in (a, b))
        assert repr(one.report) == repr(other.report)
        assert (one.diagnosed_at, one.id) == (other.diagnosed_at, other.id)
        nothing = [
            session.scalar(text("SELECT count(*) FROM diagnoses WHERE details IS NULL"))
            for session in (a, b)
        ]
        assert nothing == [1, 1]


def assert_next_key_is_free(url):
    values = {
        "youngs_modulus_pa": 1e9,
        "poisson_ratio": 0.3,
        "density_kg_m3": 1e3,
        "yield_strength_pa": 1e6,
    }
    with opened(url) as store, store.writing() as session:
        last = session.scalar(select(func.max(Material.id)))
        row = Material(name="new", source="none", **values)
        session.add(row)
        session.flush()
        assert row.id == last + 1


def test_a_place_that_holds_something_is_refused(care_copy, database_url):
    execute(database_url, "CREATE TABLE theirs (a INTEGER)")
    with pytest.raises(StoreError, match=r"holds tables \(theirs"):
        copied(care_copy, database_url)
    with pytest.raises(StoreError, match="holds a store already"):
        copied(care_copy, care_copy)


def test_a_killed_copy_leaves_an_empty_place(care_copy, tmp_path):
    assert_empty_after_kills(care_copy, url_of(tmp_path / "new.db"))


@pytest.mark.slow
def test_a_killed_copy_leaves_an_empty_database(care_copy, postgres_database):
    assert_empty_after_kills(care_copy, postgres_database)


def assert_empty_after_kills(source, target):
    steps = ["copying campaigns", "copying series_chunks", "verifying pulses"]
    script = [sys.executable, "-m", "support.processes.killed_copies", source, target, *steps]
    done = subprocess.run(script, cwd=TESTS, capture_output=True, text=True, check=False)
    assert done.stdout.splitlines() == [f"{step} True []" for step in steps], done.stderr
    assert copied(source, target)


@pytest.mark.slow
def test_a_copy_that_fails_leaves_no_file_and_a_row_written_meanwhile_is_in_none(
    care_copy, tmp_path
):
    def stop(_done, _total, what):
        if what == "verifying impacts":
            raise RuntimeError("on purpose")

    with pytest.raises(RuntimeError, match="on purpose"):
        copied(care_copy, url_of(tmp_path / "new.db"), stop)
    assert [file.name for file in tmp_path.glob("new.db*")] == []

    def write(_done, _total, what):
        if what == "copying provenance":
            execute(care_copy, "UPDATE materials SET source = 'changed'")

    tables = copied(care_copy, url_of(tmp_path / "new.db"), write)
    assert tables != copied(care_copy, url_of(tmp_path / "later.db"))
    with opened(url_of(tmp_path / "new.db")) as store, store.reading() as session:
        assert "changed" not in set(session.scalars(select(Material.source)))


def test_a_copy_that_differs_is_not_kept(care_copy, tmp_path, monkeypatch):
    from pyroshock.schema.transfer import copying
    from pyroshock.schema.transfer.copying import transfer

    load = transfer

    def spoilt(origin, copy, table, bar):
        digest = load(origin, copy, table, bar)
        if table.name == "impacts":
            copy.execute(
                text("UPDATE impacts SET impact_velocity_m_s = 1.0000000001 * impact_velocity_m_s")
            )
        return digest

    monkeypatch.setattr(copying, "transfer", spoilt)
    with pytest.raises(StoreError, match="table impacts does not read back"):
        copied(care_copy, url_of(tmp_path / "new.db"))
    assert not (tmp_path / "new.db").exists()


@pytest.mark.slow
def test_what_the_other_engine_cannot_hold_is_named(care_copy, postgres_database, tmp_path):
    execute(care_copy, "UPDATE impacts SET repetition = 5000000000 WHERE id = 1")
    with pytest.raises(StoreError, match=r"impacts\.repetition holds a number beyond"):
        copied(care_copy, postgres_database)
    execute(care_copy, "UPDATE impacts SET repetition = 50 WHERE id = 1")
    copied(care_copy, postgres_database)
    execute(postgres_database, "UPDATE pulses SET spline_nrmse = 'NaN' WHERE id = 2")
    with pytest.raises(
        StoreError, match=r"pulses\.spline_nrmse holds NaN in 1 rows, which sqlite cannot keep"
    ):
        copied(postgres_database, url_of(tmp_path / "new.db"))


@pytest.mark.slow
def test_broken_references_stop_a_copy_with_the_table(care_copy, database_url):
    execute(care_copy, "DELETE FROM configurations WHERE id = 1", keys=False)
    with pytest.raises(StoreError, match=r"table \w+ is refused.*pyroshock db check"):
        copied(care_copy, database_url)
    engine = make_engine(database_url)
    assert inspect(engine).get_table_names() == []
    engine.dispose()
