"""A question to the tuner asked from a thread of a server: it tells how far it is, and ends when it is told to."""

from __future__ import annotations

import threading
from functools import partial

import pytest
from pyroshock.app.tune.bench_adapter import setting_json, tuning_space
from pyroshock.app.tune.session import Ask, TuningSession, session_of
from pyroshock.app.twins import building as twins
from pyroshock.app.twins.building import TwinRequest
from pyroshock.doe.limits.bench import BenchLimits
from pyroshock.doe.space import shipped_factors, space_from_text
from pyroshock.doe.toml_space import with_ranges
from pyroshock.twin.setting import ElasticMaterial
from pyroshock.twin.srs.target_csv import read_target
from pyroshock.twin.tune.space import ContinuousRange
from support.records.twin_parts import unsolved
from support.stores.stores import opened


class StopError(Exception):
    """A person has enough."""


@pytest.fixture
def session(tmp_path, monkeypatch) -> TuningSession:
    """Three lines, one tip, one radius, one position: some 60 settings."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)

    monkeypatch.setattr(twins, "solved", partial(unsolved, points=1))
    text = shipped_factors("gun").replace('levels = ["PLA", "aluminum", "steel"]', 'levels = ["PLA", "steel"]')
    text = text.replace("levels = [30, 45, 60]", "levels = [30, 60]")
    (tmp_path / "spec.csv").write_text("frequency_hz,level_g\n200,20\n800,300\n")
    target = read_target(tmp_path / "spec.csv")
    url = f"sqlite:///{tmp_path / 'lab.db'}"
    with opened(url, create=True) as store:
        request = TwinRequest(contact="hertz", frequency_hz=(200.0, 400.0, 800.0))
        return session_of(store, url, Ask(target, request, space_from_text(text)))


def in_thread(session: TuningSession, step):
    found: list[object] = []

    def work() -> None:
        try:
            found.append(session.run(step))
        except Exception as error:  # noqa: BLE001 - told to the test
            found.append(error)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join(60)
    assert not thread.is_alive()
    return found[0]


def test_thread_finds_what_the_main_thread_finds_and_can_be_stopped(session):
    told = []
    tuned = in_thread(session, lambda *step: told.append(step))
    again = session.run()
    assert [setting_json(p.setting) for p in tuned.proposals] == [setting_json(p.setting) for p in again.proposals]
    assert [p.probability_within for p in tuned.proposals] == [p.probability_within for p in again.proposals]
    assert all(0 < done <= total for done, total, _ in told)
    assert {"grid", "refined by 1.3", "refined by 1.1"} <= {what for _, _, what in told}

    def stop(*_: object) -> None:
        raise StopError

    assert isinstance(in_thread(session, stop), StopError)


def test_ranges_of_a_plan_are_ranges_of_the_tuner() -> None:
    """Any mass of a continuous factor, and nine tips of a continuous radius."""
    text = with_ranges(shipped_factors("gun"), {"bullet_mass_kg": (0.2, 1), "tip_radius_mm": (30, 60)})
    steel = ElasticMaterial("steel", 210e9, 0.29, 7850.0)
    space = tuning_space(space_from_text(text), lambda _: steel, steel, 0.05, 700.0, ("1",), BenchLimits())
    assert space.impactor_mass_kg == ContinuousRange(0.2, 1.0)
    assert (space.tip_radii_m[0], space.tip_radii_m[-1], len(space.tip_radii_m)) == (0.03, 0.06, 9)
