"""The audit trail: a row goes with its change or not at all, says what was asked without secrets,
and is left by what the suite of every door does not reach."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pyroshock.app.jobs.worker import Worker
from pyroshock.app.operations.catalogue import operation, operations
from pyroshock.app.operations.change_record import request_json
from pyroshock.app.operations.faults import read
from pyroshock.app.operations.laboratory import Laboratory
from pyroshock.app.operations.operation import Operation, Outcome, Request
from pyroshock.schema.audit import AuditEntry, AuditRow
from pyroshock.schema.benches import Material
from pyroshock.schema.person_roles import USER, Person, RoleNeededError
from pyroshock.schema.session import Store, Writer
from sqlalchemy import select, update
from support.processes.web_client import post_json, window
from support.records.campaigns import (
    blows,
    force_record,
    hammer_campaign,
    recording_name,
    write_recording,
)
from support.stores.hammer_stores import full_campaign
from support.stores.stores import ingested, opened, pyroshock, run_pyroshock

ADA = Person("ada", "administrator", USER, 1)


def rows(store: Store) -> list[tuple[Any, ...]]:
    """Operation, subject, outcome, person and kind of each row."""
    query = select(
        AuditRow.operation,
        AuditRow.subject,
        AuditRow.outcome,
        AuditRow.person,
        AuditRow.person_kind,
    ).order_by(AuditRow.id)
    with store.reading() as session:
        return [tuple(row) for row in session.execute(query)]


def names(url: str) -> list[str]:
    with opened(url) as store:
        return [row[0] for row in rows(store)]


def material(name: str) -> Material:
    return Material(
        name=name,
        youngs_modulus_pa=1e9,
        poisson_ratio=0.3,
        density_kg_m3=1e3,
        yield_strength_pa=1e6,
        source="s",
    )


def changing(run: Any) -> Operation[Any, Any]:
    """An operation that is made up."""
    return Operation(name="made-up", request=Request, run=run, help="h")


def ask(store: Store, made_up: Operation[Any, Any]) -> Any:
    signed = Store(store.engine, Writer("test", "0", ADA))
    return made_up.answer(Request(), Laboratory(signed, ""), lambda *_: None)


@pytest.fixture
def store(database_url: str):
    with opened(database_url, create=True) as opened_store:
        yield opened_store


def test_the_row_is_in_the_transaction_of_the_change(store: Store) -> None:
    def change(_: Request, laboratory: Laboratory, __: Any) -> Outcome:
        with laboratory.store.writing() as session:
            session.add(material("one"))
            session.flush()
            # Nobody else sees either of the two before the end.
            assert rows(store) == []
        assert len(rows(store)) == 1
        with laboratory.store.writing() as session:
            session.add(material("two"))
        return Outcome((), {})

    ask(store, changing(change))
    assert rows(store) == [("made-up", "", "done", "ada", "user")]


def test_a_change_that_is_rolled_back_leaves_no_row(store: Store) -> None:
    def change(_: Request, laboratory: Laboratory, __: Any) -> Outcome:
        with laboratory.store.writing() as session:
            session.add(material("one"))
            session.flush()
            raise ValueError("no")

    with pytest.raises(ValueError, match="no"):
        ask(store, changing(change))
    assert rows(store) == []
    with store.reading() as session:
        assert session.scalar(select(Material).where(Material.name == "one")) is None


def test_a_change_that_breaks_off_has_a_second_row_with_the_error(store: Store) -> None:
    def change(_: Request, laboratory: Laboratory, __: Any) -> Outcome:
        laboratory.store.write(lambda session: session.add(material("one")))
        raise ValueError("the disk of postgresql://u:secret@host/db is full")

    with pytest.raises(ValueError, match="full"):
        ask(store, changing(change))
    assert [row[2] for row in rows(store)] == ["done", "failed"]
    with store.reading() as session:
        message = session.scalars(select(AuditRow.message).order_by(AuditRow.id.desc())).first()
    assert "is full" in message and "secret" not in message


def test_what_changes_nothing_leaves_no_row(store: Store) -> None:
    def change(_: Request, laboratory: Laboratory, __: Any) -> Outcome:
        laboratory.store.write(lambda session: session.scalar(select(Material.name)))
        return Outcome((), {})

    ask(store, changing(change))
    assert rows(store) == []


def test_a_change_without_a_new_row_has_its_row(store: Store) -> None:
    def change(_: Request, laboratory: Laboratory, __: Any) -> Outcome:
        laboratory.store.write(
            lambda session: session.execute(update(Material).values(source="another"))
        )
        return Outcome((), {})

    ask(store, changing(change))
    assert [row[0] for row in rows(store)] == ["made-up"]


def test_an_operation_within_another_leaves_one_row(store: Store) -> None:
    def inner(_: Request, laboratory: Laboratory, __: Any) -> Outcome:
        laboratory.store.write(lambda session: session.add(material("one")))
        return Outcome((), {})

    def outer(request: Request, laboratory: Laboratory, step: Any) -> Outcome:
        return changing(inner).answer(request, laboratory, step)

    ask(store, changing(outer))
    assert len(rows(store)) == 1


def test_many_writers_leave_as_many_rows_as_changes(store: Store) -> None:
    def work(number: int) -> None:
        def change(_: Request, laboratory: Laboratory, __: Any) -> Outcome:
            laboratory.store.write(lambda session: session.add(material(f"m{number}")))
            return Outcome((), {})

        ask(store, changing(change))

    threads = [threading.Thread(target=work, args=(number,)) for number in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(rows(store)) == 8


def test_a_person_without_the_role_is_refused_before_anything_is_done(store: Store) -> None:
    done = []
    made_up = changing(lambda *_: done.append(1))
    signed = Store(store.engine, Writer("test", "0", Person("rita", "reader", USER, 2)))
    with pytest.raises(RoleNeededError, match="needs the role operator, and rita has the role"):
        made_up.answer(Request(), Laboratory(signed, ""), lambda *_: None)
    assert done == [] and rows(store) == []


def test_secrets_and_contents_are_not_in_the_row() -> None:
    declared = operation("user-add")
    values = {"name": "ben", "role": "reader", "password": "four quiet grey herons"}
    assert request_json(read(declared.request, values, "python")) == {"name": "ben"}
    calibration = operation("calibrate")
    content = "reference,reading_v\n0,0.3626\n1,0.9248\n2,1.4862\n"
    asked = read(calibration.request, {"file": content, "date": "2026-03-02"}, "python")
    assert "0.9248" not in str(request_json(asked)) and "characters" in str(request_json(asked))


def test_commands_that_change_a_campaign_leave_their_rows(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'lab.db'}"
    folder = hammer_campaign(tmp_path / "spring", recordings=3, hits=1, name="spring")
    ingested(url, folder)
    ingested(url, folder)  # nothing is new
    db, reason = ("--db", url), ("--reason", "r")
    run_pyroshock("runs", "discard", "spring", recording_name(3), *reason, *db)
    out = tmp_path / "spring.pyroshock"
    run_pyroshock("campaigns", "archive", "spring", "--out", out, *reason, *db)
    run_pyroshock("campaigns", "restore", out, *db)
    assert names(url) == [
        *("ingest", "run-discard", "archive", "restore"),
    ]
    assert pyroshock("campaigns", "delete", "spring", *reason, "--dry-run", *db).exit_code == 0
    assert len(names(url)) == 4
    run_pyroshock("campaigns", "delete", "spring", *reason, *db)
    assert names(url)[-1] == "campaign-delete"
    with opened(url) as store:
        assert {row[4] for row in rows(store)} == {"system"}


def test_making_a_store_has_its_row_and_finding_one_has_none(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'lab.db'}"
    for _ in range(2):
        run_pyroshock("init", "--db", url)
        with opened(url) as store:
            assert [row[:3] for row in rows(store)] == [("init", "", "done")]
    another = f"sqlite:///{tmp_path / 'other.db'}"
    run_pyroshock("plan", "lhs", "autumn", "--runs", "4", "--db", another)
    assert names(another) == ["plan"]


def test_what_the_examples_of_every_door_do_not_change_has_its_row_where_it_changes(
    tmp_path: Path,
) -> None:
    """A replaced recording, and a store that is put back from its backup."""
    url = f"sqlite:///{tmp_path / 'lab.db'}"
    folder = hammer_campaign(tmp_path / "spring", recordings=2, hits=1, name="spring")
    ingested(url, folder)
    db, reason = ("--db", url), ("--reason", "r")
    write_recording(
        folder / recording_name(1),
        {"force": force_record(blows(1, 1), np.random.default_rng(7))},
    )
    replaced = ("runs", "replace", "spring", recording_name(1), "--from", folder)
    assert pyroshock(*replaced, *reason, "--dry-run", *db).exit_code == 0
    assert names(url) == ["ingest"]
    run_pyroshock(*replaced, *reason, *db)
    assert names(url) == ["ingest", "run-replace"]
    ingested(url, full_campaign(tmp_path / "summer", "summer"))
    changes = ["ingest", "run-replace", "ingest", "dataset-build"]
    for _ in range(2):  # the same dataset again is none that is new
        run_pyroshock("dataset", "build", "both", "--from", "summer", *db)
        assert names(url) == changes
    run_pyroshock("db", "backup", tmp_path / "backup", *db)
    restored_url = f"sqlite:///{tmp_path / 'again.db'}"
    run_pyroshock("db", "restore", tmp_path / "backup", "--db", restored_url)
    assert names(restored_url) == [*changes, "db-restore"]


@pytest.mark.parametrize(("name", "address", "body"), [
    ("tune", "/api/tune", {"target": "frequency_hz,level_g\n100,50\n10000,80\n"}),
    ("validate", "/api/validate", {"campaign": "spring"}),
])  # fmt: skip
def test_long_work_that_is_asked_for_has_its_row_and_another_when_it_ends(
    tmp_path: Path, name: str, address: str, body: dict[str, str]
) -> None:
    """Also where it fails: a hammer has no gun to tune, and too few shots to validate."""
    url = f"sqlite:///{tmp_path / 'lab.db'}"
    ingested(url, hammer_campaign(tmp_path / "spring", recordings=2, hits=1, name="spring"))
    with window(url, works=False) as (client, store):
        job = post_json(client, address, body).json()["id"]
        assert [row[0::2] for row in rows(store)][1:] == [(name, "asked", "local")]
        Worker(store, url).run(once=True)
        ended_as = client.get(f"/api/jobs/{job}").json()["state"]
        assert [row[0::2] for row in rows(store)][2:] == [(name, ended_as, "local")]
    assert {"tune", "validate"} <= {declared.name for declared in operations() if declared.changes}


def test_the_check_of_the_store_names_a_row_of_the_trail_that_was_altered(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'lab.db'}"
    with opened(url, create=True) as store:
        with store.writing() as session:
            session.add(AuditEntry(ADA, "promote", "gp", {}).row())
        assert pyroshock("db", "check", "--db", url).exit_code == 0
        with store.engine.begin() as connection:
            connection.exec_driver_sql("UPDATE audit_rows SET person = 'eve'")
    check_result = pyroshock("db", "check", "--db", url)
    assert check_result.exit_code == 1 and "audit_rows" in check_result.output
