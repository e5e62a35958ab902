"""Some clients at once whose work meets another's: nothing is lost, nothing is doubled, nobody sees
an error."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Barrier
from typing import TypeVar

import numpy as np
import pytest
from pyroshock.app.twins.adopted_effects import adopt
from pyroshock.doe.designs.base import Design
from pyroshock.doe.plans import PlanExistsError, add_plan, extend_plan, read_plan, tick_run
from pyroshock.doe.space import gun_space, shipped_factors
from pyroshock.ingest.extraction.settings import ExtractionSettings
from pyroshock.ingest.storing.plan_link import link_campaign
from pyroshock.ingest.storing.reextraction import reextract
from pyroshock.schema.campaigns import ConfigurationLevel, Plan, PlannedRun
from pyroshock.schema.configurations import configuration_ids
from pyroshock.schema.diagnoses import TwinVersion
from pyroshock.schema.impacts import Shot
from pyroshock.schema.known_factors import RunLevel
from pyroshock.schema.session import Store, Writer, open_store
from sqlalchemy import func, select
from support.processes.crowd import complaints, together
from support.records import verdicts
from support.records.campaigns import gun_campaign, hammer_campaign
from support.stores.stores import assert_whole, content, counts, ingested, opened

CLIENTS = 6
Came = TypeVar("Came")


@pytest.fixture
def at_once(tables_url: str) -> Callable[[Callable[[Store, int], Came]], list[Came | Exception]]:
    """Calls a function in as many threads as there are clients, each with a store of its own, at
    the same moment."""
    with opened(tables_url, create=True):
        pass

    def run(work: Callable[[Store, int], Came]) -> list[Came | Exception]:
        barrier = Barrier(CLIENTS)

        def client(number: int) -> Came | Exception:
            with open_store(tables_url, Writer(f"client {number}", "0")) as store:
                barrier.wait(60)
                try:
                    return work(store, number)
                except Exception as error:  # noqa: BLE001 - whatever a client would be shown
                    return error

        with ThreadPoolExecutor(CLIENTS) as pool:
            return list(pool.map(client, range(CLIENTS)))

    return run


def test_folders_in_different_orders_at_once(database_url: str, tmp_path: Path) -> None:
    folders = [hammer_campaign(tmp_path / "hammer", 2), gun_campaign(tmp_path / "gun", 10)]
    commands = [
        [("ingest", folder, "--jobs", "1", "--db", database_url) for folder in folders[::way]]
        for way in (1, -1)
    ]
    assert complaints(together(tmp_path / "said", commands * 2)) == []
    url = f"sqlite:///{tmp_path / 'sequential.db'}"
    ingested(url, *folders)
    assert content(database_url) == content(url)
    assert_whole(database_url, 2)


def test_same_new_configurations_in_any_order(at_once, tables_url) -> None:
    """Rows added in different orders are how two transactions come to wait for each other."""
    combinations = [[RunLevel("speed", f"v{i}"), RunLevel("tip", f"t{i % 5}")] for i in range(20)]

    def add(store: Store, number: int) -> list[int]:
        mixed = np.random.default_rng(number).permutation(20)
        keys = store.write(
            lambda session: configuration_ids(session, [combinations[i][::-1] for i in mixed])
        )
        return [key for _, key in sorted(zip(mixed, keys, strict=True))]

    found = at_once(add)
    assert all(keys == found[0] for keys in found)
    with opened(tables_url) as store, store.reading() as session:
        assert session.scalar(select(func.count()).select_from(ConfigurationLevel)) == 40


def test_one_campaign_cut_by_all(at_once, tables_url, tmp_path) -> None:
    ingested(tables_url, hammer_campaign(tmp_path / "c", 2, name="c"))
    reports = at_once(lambda store, _: reextract(store, "c", ExtractionSettings(threshold=0.02)))
    assert sum(report.added for report in reports) == 4
    assert (
        sum(report.reused for report in reports) == 4 * (CLIENTS - 1)
        and counts(tables_url)["pulses"] == 8
    )


def planned(store: Store, runs: int = 12, name: str = "spring") -> None:
    space = gun_space()
    chosen = np.random.default_rng(1).choice(space.size, runs, replace=False)
    design = Design(space, space.all_treatments()[chosen], "import", None)
    add_plan(store, name, shipped_factors("gun"), design, repetitions=1)


def test_one_of_many_gets_a_plans_name(at_once, tables_url) -> None:
    found = at_once(lambda store, _: planned(store))
    assert (
        found.count(None) == 1
        and sum(isinstance(client_error, PlanExistsError) for client_error in found) == CLIENTS - 1
    )
    assert counts(tables_url)["planned_runs"] == 12


def test_plan_is_changed_by_all(at_once, tables_url) -> None:
    with opened(tables_url, create=True) as store, store.reading() as session:
        planned(store)
        rows = [run.row for run in read_plan(session, "spring").runs[:3]]

    def change(store: Store, number: int) -> list[int]:
        tick_run(store, "spring", number + 1, status="discarded", note="no good")
        return extend_plan(store, "spring", rows, repetitions=1)

    assert sorted(
        [number for client_numbers in at_once(change) for number in client_numbers]
    ) == list(range(13, 13 + 3 * CLIENTS))
    with opened(tables_url) as store, store.reading() as session:
        states = [run.status for run in read_plan(session, "spring").runs]
    assert states.count("discarded") == CLIENTS


def test_campaign_linked_by_all(at_once, tables_url, tmp_path) -> None:
    ingested(tables_url, gun_campaign(tmp_path / "gun", 10))
    with opened(tables_url) as store, store.writing() as session:
        plan = Plan(name="gun", kind="gun", factors="", method="import")
        session.add(plan)
        session.flush()
        shots = session.execute(select(Shot.run, Shot.configuration_id)).all()
        common = {"plan_id": plan.id, "repetitions": 1, "treatment": {}, "settings": {}}
        session.add_all(
            PlannedRun(run=run, position=run, configuration_id=key, **common) for run, key in shots
        )
    links = at_once(lambda store, _: link_campaign(store, "gun", "gun"))
    assert sum(link.linked for link in links) == 10 and sum(link.done for link in links) == 10


def test_versions_adopted_by_all_are_numbered(at_once, tables_url, tmp_path) -> None:
    ingested(tables_url, gun_campaign(tmp_path / "gun", name="spring"))
    verdict = verdicts.verdict(campaign="spring")
    found = at_once(lambda store, _: adopt(store, verdict, "none").version)
    assert sorted(found) == list(range(1, CLIENTS + 1))
    with opened(tables_url) as store, store.reading() as session:
        assert session.scalar(select(func.count()).select_from(TwinVersion)) == CLIENTS
