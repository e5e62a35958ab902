"""Twins that stay ready: built once, anew when what they are made of has changed, and as good as
fresh ones."""

from __future__ import annotations

import os
import shutil
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pyroshock.app.operations.predict.request import ShotRequest
from pyroshock.app.twins import twin_cache as twin_stamps
from pyroshock.app.twins import twin_cache as warm_twins
from pyroshock.app.twins.adopted_effects import adopt
from pyroshock.app.twins.building import BuiltTwin, TwinRequest, twin_of
from pyroshock.app.twins.twin_cache import TwinCache
from pyroshock.schema.benches import Material
from pyroshock.training.registry.records import DatasetName
from pyroshock.twin.effects import effect
from pyroshock.twin.plate.response import PlateResponse
from support.records import verdicts
from support.records.predicted_shots import predicted_json
from support.stores.stores import opened

FEW = (200.0, 400.0, 800.0)


@pytest.fixture
def quick(quick_twins):
    return f"sqlite:///{quick_twins / 'lab.db'}"


@pytest.fixture
def store(quick, examples_db, tmp_path):
    shutil.copy(examples_db, tmp_path)
    with opened(quick) as store:
        yield store


@dataclass
class Counted:
    """Builds nothing but says how often it was asked; slow enough that threads meet."""

    times: int = 0

    def __call__(self, _store, _db, request: TwinRequest) -> BuiltTwin:
        time.sleep(0.02)
        self.times += 1
        return SimpleNamespace(request=request, number=self.times)  # type: ignore[return-value]


@pytest.fixture
def counted(monkeypatch):
    monkeypatch.setattr(warm_twins, "warm_up", lambda _: None)
    return Counted()


def shelf_of(store, db, counted, **own) -> TwinCache:
    return TwinCache(store, db, build=counted, **own)


def test_twin_is_built_once(store, quick, counted):
    shelf = shelf_of(store, quick, counted)
    first, again = shelf.get(TwinRequest()), shelf.get(TwinRequest())
    assert first is again and counted.times == 1 and shelf.get(TwinRequest(q=25.0)) is not first


def test_threads_that_ask_for_the_same_wait_for_one(store, quick, counted):
    shelf, found = shelf_of(store, quick, counted), []
    with ThreadPoolExecutor(8) as pool:
        pool.map(lambda _: found.append(shelf.get(TwinRequest())), range(8))
    assert (len(found), len({id(each) for each in found}), counted.times) == (8, 1, 1)


def test_last_few_are_kept(store, quick, counted):
    shelf = shelf_of(store, quick, counted, kept=2)
    for q in (5.0, 10.0, 5.0, 20.0):  # 10 was asked for before 5 was again: it goes
        shelf.get(TwinRequest(q=q))
    assert counted.times == 3
    shelf.get(TwinRequest(q=5.0))
    assert counted.times == 3
    shelf.get(TwinRequest(q=10.0))
    assert counted.times == 4


def test_failure_is_not_kept(store, quick, monkeypatch):
    monkeypatch.setattr(warm_twins, "warm_up", lambda _: None)
    answers = [LookupError("no campaign 'winter'"), SimpleNamespace()]

    def build(*_):
        answer = answers.pop(0)
        if isinstance(answer, Exception):
            raise answer
        return answer

    shelf = TwinCache(store, quick, build=build)
    with pytest.raises(LookupError, match="winter"):
        shelf.get(TwinRequest(campaign="winter"))
    assert shelf.get(TwinRequest(campaign="winter")) is not None


def _effect(store, _table):
    adopt(store, verdicts.verdict(campaign="first-shots"), "gun.valve_flow")


def _material(store, _table):
    more = {
        "youngs_modulus_pa": 1.1e11,
        "poisson_ratio": 0.34,
        "density_kg_m3": 4430.0,
        "yield_strength_pa": 8.8e8,
    }
    with store.writing() as session:
        session.add(Material(name="titanium", source="sheet", **more))


def _table(_store, table):
    table.write_text("b")
    os.utime(table, (1, 1))


@pytest.mark.parametrize("change", [_effect, _material, _table])
def test_new_effect_material_or_modal_table_makes_a_new_twin(
    store, quick, counted, tmp_path, change
):
    table = tmp_path / "modes.csv"
    table.write_text("a")
    shelf, request = (
        shelf_of(store, quick, counted),
        TwinRequest(modes=table if change is _table else None),
    )
    shelf.get(request)
    change(store, table)
    shelf.get(request)
    assert counted.times == 2


@dataclass
class InUse:
    """A registry whose champion changes."""

    file: Path
    sha256: str = "1"
    asked: int = 0

    @property
    def place(self):
        return SimpleNamespace(database=self.file)

    @property
    def connection(self):
        return SimpleNamespace(nothing_there=False)

    def versions(self):
        self.asked += 1
        dataset = DatasetName("spring", "5" * 64, "gun")
        return [
            SimpleNamespace(
                sha256=self.sha256, champion_of="gun", promoted_at="2026", dataset=dataset
            )
        ]

    def changed(self, text: str) -> None:
        self.file.write_text(text)


@pytest.fixture
def in_use(tmp_path, monkeypatch):
    registry = InUse(tmp_path / "models.db")
    registry.changed("one")
    monkeypatch.setattr(twin_stamps, "registry_of", lambda _: registry)
    return registry


def test_another_champion_makes_a_new_twin(store, quick, counted, in_use):
    shelf = shelf_of(store, quick, counted)
    shelf.get(TwinRequest())
    shelf.get(TwinRequest())
    assert (counted.times, in_use.asked) == (1, 1)
    in_use.changed("a training began")
    shelf.get(TwinRequest())
    assert (counted.times, in_use.asked) == (1, 2)
    in_use.sha256 = "2"
    in_use.changed("and its model is the champion")
    shelf.get(TwinRequest())
    assert (counted.times, in_use.asked) == (2, 3)


def test_law_does_not_depend_on_the_registry(store, quick, counted, in_use):
    shelf = shelf_of(store, quick, counted)
    acting = (effect("contact.effective_mass"),)
    for request in (TwinRequest(contact="hertz"), TwinRequest(contact="hertz", effects=acting)):
        shelf.get(request)
        in_use.changed(f"{request}")
        shelf.get(request)
    assert (counted.times, in_use.asked) == (2, 0)


def test_warm_twin_answers_as_a_fresh_one_in_every_thread(store, quick):
    request, shot = (
        TwinRequest(frequency_hz=FEW),
        ShotRequest(tank_pressure_pa=3e5, impact_position="#2"),
    )
    warm = TwinCache(store, quick).get(request)
    for _ in range(2):
        assert predicted_json(warm, shot, draws=8) == predicted_json(
            twin_of(store, quick, request), shot, draws=8
        )
    twin = TwinCache(store, quick).get(TwinRequest(frequency_hz=FEW))
    shots = [
        ShotRequest(tank_pressure_pa=pressure) for pressure in np.linspace(1e5, 7e5, 6).tolist()
    ]
    alone: list[dict[str, Any]] = [predicted_json(twin, shot) for shot in shots]
    with ThreadPoolExecutor(len(shots)) as pool:
        assert list(pool.map(lambda shot: predicted_json(twin, shot), shots)) == alone


def test_warm_twin_solves_no_plate_any_more(store, quick, monkeypatch):
    made, of = [], PlateResponse.of
    monkeypatch.setattr(PlateResponse, "of", lambda *given: made.append(given) or of(*given))
    twin = TwinCache(store, quick).get(TwinRequest(frequency_hz=FEW))
    assert made
    made.clear()
    for position in ("#1", "#2"):
        predicted_json(twin, ShotRequest(impact_position=position))
    assert made == []


def test_shipped_bench_needs_no_store(quick):
    prediction = predicted_json(
        TwinCache(None, quick).get(TwinRequest(frequency_hz=FEW)), ShotRequest()
    )
    assert "shipped" in prediction["models"]["gun"]
