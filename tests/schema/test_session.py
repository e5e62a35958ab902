"""The store's promises: whole transactions, signed rows, rules in the database, clear refusals,
JSON as it went in."""

from __future__ import annotations

import datetime as dt
import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.schema.base import from_plain, to_plain
from pyroshock.schema.benches import Material
from pyroshock.schema.campaigns import Campaign, Factor
from pyroshock.schema.diagnoses import Diagnosis
from pyroshock.schema.impacts import Impact
from pyroshock.schema.provenance import Provenance
from pyroshock.schema.recordings import Recording
from pyroshock.schema.session import Store, StoreError, Writer, count_rows, make_engine, open_store
from pyroshock.schema.transactions import get_or_add
from sqlalchemy import select
from sqlalchemy.exc import IntegrityError, StatementError

WRITER = Writer("pyroshock test", "1.2.3")


@pytest.fixture
def store(tables_url):
    with open_store(tables_url, WRITER, create=True) as store:
        yield store


def material(**changes):
    values = {
        "youngs_modulus_pa": 1e9,
        "poisson_ratio": 0.3,
        "density_kg_m3": 1e3,
        "yield_strength_pa": 1e6,
    }
    return Material(**({"name": "test", "source": "none"} | values | changes))


def campaign(name="c", **changes):
    return Campaign(
        **({"name": name, "kind": "gun", "date": dt.date(2026, 1, 2), "fingerprint": "f"} | changes)
    )


def test_new_store_knows_the_thesis_materials_and_rows_their_writer(store):
    with store.reading() as session:
        steel = session.scalars(select(Material).where(Material.name == "steel")).one()
        assert (steel.youngs_modulus_pa, steel.poisson_ratio, steel.density_kg_m3) == (
            200e9,
            0.30,
            7800,
        )
        assert "Table 4.2" in steel.source
        names = set(session.scalars(select(Material.name)))
        assert names == {"aluminum", "steel", "delrin", "polyurethane", "PLA"}
    with store.writing() as session:
        session.add(material())
    with store.reading() as session:
        row = session.scalars(select(Material).where(Material.name == "test")).one()
        writer = session.get_one(Provenance, row.written_by_id)
        assert (writer.command, writer.software_version) == ("pyroshock test", "1.2.3")
        assert writer.started_at.utcoffset() == dt.timedelta(0)


def test_opening_again_adds_nothing(database_url):
    with open_store(database_url, WRITER, create=True) as store:
        before = count_rows(store)
    with open_store(database_url, WRITER, create=True) as store:
        assert count_rows(store) == before


def test_failing_block_stores_nothing(store):
    before = count_rows(store)
    with pytest.raises(RuntimeError, match="on purpose"), store.writing() as session:
        session.add(material())
        session.flush()
        raise RuntimeError("on purpose")
    assert count_rows(store) == before


@pytest.mark.parametrize("whole", [True, False], ids=["first write", "savepoint"])
def test_signature_survives_a_rolled_back_first_write_or_savepoint(store, whole):
    with Store(
        make_engine(store.engine.url.render_as_string(hide_password=False)), WRITER
    ) as fresh:
        if whole:
            with pytest.raises(IntegrityError), fresh.writing() as session:
                session.add(material(name="steel"))
        with fresh.writing() as session:
            if not whole:
                with pytest.raises(IntegrityError), session.begin_nested():
                    session.add(material(name="steel"))
                    session.flush()
            session.add(material())
        with fresh.reading() as session:
            row = session.scalars(select(Material).where(Material.name == "test")).one()
            assert session.get(Provenance, row.written_by_id) is not None


@pytest.mark.parametrize(
    "row",
    [
        material(poisson_ratio=0.5),
        material(density_kg_m3=-1.0),
        material(youngs_modulus_pa=0.0),
        material(name="steel"),
        campaign(kind="bow"),
        Impact(campaign_id=1, run=1, repetition=1, configuration_id=1),
    ],
    ids=["poisson", "density", "modulus", "twice", "kind", "orphan"],
)
def test_rules_live_in_the_database(store, row):
    with pytest.raises(IntegrityError), store.writing() as session:
        session.add(row)


def test_times_come_back_in_utc_and_a_naive_one_is_refused(store):
    here = dt.datetime(2026, 1, 1, 12, tzinfo=dt.timezone(dt.timedelta(hours=5)))
    own = {"campaign_id": 1, "simulator": "s", "report": {}}
    with store.writing() as session:
        session.add(campaign())
        session.flush()
        session.add(Diagnosis(diagnosed_at=here, **own))
    with store.reading() as session:
        back = session.scalars(select(Diagnosis.diagnosed_at)).one()
        assert (back, back.utcoffset()) == (here, dt.timedelta(0))
    with pytest.raises(StatementError, match="naive time"), store.writing() as session:
        session.add(Diagnosis(diagnosed_at=dt.datetime(2026, 1, 1), **own))  # noqa: DTZ001


def test_get_or_add_adds_once_and_shows_another_broken_rule(store):
    own = {"date": dt.date(2026, 1, 1), "fingerprint": "f"}
    with store.writing() as session:
        first = get_or_add(session, Campaign, {"name": "c"}, {"kind": "gun", **own})
        assert get_or_add(session, Campaign, {"name": "c"}, {"kind": "hammer"}) is first
    with pytest.raises(IntegrityError), store.writing() as session:
        get_or_add(session, Campaign, {"name": "d"}, {"kind": "bow", **own})


def test_missing_store_names_the_command(tmp_path):
    with pytest.raises(StoreError, match=r"pyroshock init --db sqlite:///.*nothing\.db"):
        open_store(f"sqlite:///{tmp_path}/nothing.db", WRITER)
    assert not (tmp_path / "nothing.db").exists()


@pytest.mark.parametrize(
    "url", ["nonsense:x", "mysql://a/b", "sqlite:////no/such/folder/x.db", "sqlite:///x.db"]
)
def test_unusable_address_is_refused(tmp_path, monkeypatch, url):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "x.db").write_bytes(
        b"this is not a database, but it is long enough to look at" * 100
    )
    with pytest.raises(StoreError, match=r"x\.db" if "x.db" in url else None):
        open_store(url, WRITER, create=True)
    with pytest.raises(StoreError) as caught:
        open_store("postgresql+psycopg://someone:secret@127.0.0.1:1/none", WRITER)
    assert "secret" not in str(caught.value)


def test_foreign_tables_are_not_taken_over(database_url):
    engine = make_engine(database_url)
    with engine.begin() as connection:
        connection.exec_driver_sql("CREATE TABLE theirs (a INTEGER)")
    engine.dispose()
    with pytest.raises(StoreError, match="not a pyroshock store"):
        open_store(database_url, WRITER, create=True)


def test_recording_of_gigabytes_has_its_size(store):
    """PostgreSQL's integers end at 2 GB: such a file was refused there, and stored on SQLite."""
    with store.writing() as session:
        session.add(of := campaign())
        session.flush()
        large = {
            "path": "day.tdms",
            "sha256": "0" * 64,
            "size_bytes": 5_000_000_000,
            "format": "tdms",
        }
        session.add(Recording(campaign_id=of.id, status="stored", **large))
    with store.reading() as session:
        assert session.scalars(select(Recording.size_bytes)).one() == 5_000_000_000


def test_rows_added_at_once_are_signed_and_in_order(store):
    rows = [{"name": "b"}, {"name": "a", "si_unit": "m"}, {"name": "c", "description": "d"}]
    before = count_rows(store)
    with store.writing() as session:
        store.add_rows(session, Factor, [])
    assert count_rows(store) == before
    with store.writing() as session:
        store.add_rows(session, Factor, rows)
    with store.reading() as session:
        found = session.scalars(select(Factor).order_by(Factor.id)).all()
        assert [(row.name, row.si_unit, row.description) for row in found] == [
            ("b", None, None), ("a", "m", None), ("c", None, "d")
        ]  # fmt: skip
        assert {session.get_one(Provenance, row.written_by_id).command for row in found} == {
            "pyroshock test"
        }


TEXT = st.text(st.characters(exclude_characters="\x00", exclude_categories=["Cs"]))
VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | TEXT,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(TEXT, inner, max_size=4),
    max_leaves=12,
)


def same(a, b):
    if isinstance(a, float) and isinstance(b, float):
        return a == b or (math.isnan(a) and math.isnan(b))
    if isinstance(a, list) and isinstance(b, list):
        return len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, dict) and isinstance(b, dict):
        return a.keys() == b.keys() and all(same(a[k], b[k]) for k in a)
    return type(a) is type(b) and a == b


@given(VALUES)
def test_plain_and_back_is_the_same(value):
    text = json.dumps(to_plain(value), allow_nan=False)
    assert same(from_plain(json.loads(text)), value)


def test_numpy_becomes_python():
    value = {"a": np.float32(0.5), "b": np.arange(3), "c": np.bool_(True), "d": (np.nan, 1)}
    plain = to_plain(value)
    assert plain == {"a": 0.5, "b": [0, 1, 2], "c": True, "d": [{"$float": "nan"}, 1]}
    with pytest.raises(TypeError, match="object"):
        to_plain(object())


def test_both_engines_store_what_json_has_not(database_url):
    report = {
        "nan": math.nan,
        "inf": -math.inf,
        "text": "half \ud800 and nul \x00",
        "list": [np.float64(1.5)],
    }
    with open_store(database_url, Writer("test", "0"), create=True) as store:
        with store.writing() as session:
            session.add(Campaign(name="c", kind="gun", date=dt.date(2026, 1, 1), fingerprint="f"))
            session.flush()
            when = dt.datetime(2026, 1, 1, tzinfo=dt.UTC)
            session.add(Diagnosis(campaign_id=1, simulator="s", report=report, diagnosed_at=when))
        with store.reading() as session:
            back = session.scalars(select(Diagnosis.report)).one()
    assert math.isnan(back["nan"])
    assert back["inf"] == -math.inf
    assert back["text"] == "half ? and nul \ufffd"
    assert back["list"] == [1.5]
