"""`tune` on the command line and in a thread of a server: its JSON, what it refuses, how it is
stopped."""

from __future__ import annotations

import json
import re
import threading
from functools import partial
from pathlib import Path

import pytest
from pyroshock.app.common.number_format import percent
from pyroshock.app.operations.fields import TextFile
from pyroshock.app.operations.tune.bench_adapter import setting_json, tuning_space
from pyroshock.app.operations.tune.request import SpectrumSearch
from pyroshock.app.operations.tune.session import TuningSession, session_of
from pyroshock.app.twins import building as twins
from pyroshock.app.twins.building import TwinRequest
from pyroshock.doe.limits.bench import BenchLimits
from pyroshock.doe.space import shipped_factors, space_from_text
from pyroshock.doe.toml_space import with_ranges
from pyroshock.twin.setting import ElasticMaterial
from pyroshock.twin.srs.target_csv import read_target
from pyroshock.twin.tune.space import ContinuousRange
from support.records.twin_parts import unsolved
from support.stores.stores import opened, pyroshock

SPEC = "frequency_hz,level_g\n100,20\n1000,400\n4000,400\n"


@pytest.fixture
def url(tmp_path: Path) -> str:
    url = f"sqlite:///{tmp_path / 'lab.db'}"
    assert pyroshock("init", "--db", url).exit_code == 0
    (tmp_path / "spec.csv").write_text(SPEC)
    (tmp_path / "modes.csv").write_text(
        "mode,frequency_hz,damping_ratio,shape_impact,shape_acceleration_1\n"
        "1,250,0.01,0.5,0.4\n2,900,0.01,-0.6,0.5\n3,2200,0.01,0.5,-0.5\n4,3900,0.01,0.4,0.5\n"
    )
    return url


def tune(url, tmp_path, *words):
    modes = ("--modes", tmp_path / "modes.csv", "--contact", "hann")
    return pyroshock("tune", "--target", tmp_path / "spec.csv", *modes, "--db", url, *words)


@pytest.mark.slow
def test_ranked_settings_have_the_keys_of_the_contract(url, tmp_path):
    avoid, plot = tmp_path / "avoid.json", tmp_path / "tuned.png"
    words = ("--tolerance", "20dB", "--at-least", "0.05", "--avoid", avoid, "--plot", plot)
    result = tune(url, tmp_path, *words, "--json")
    assert result.exit_code == 0, result.stderr
    assert (
        "meets the target: the setting has" in result.stderr
        or "meet the target: the best has" in result.stderr
    )
    rows = json.loads(result.stdout)
    assert {"settings", "probability_within", "worst_margin_db", "worst_frequency_hz"} <= set(
        rows[0]
    )
    assert [row["rank"] for row in rows] == list(range(1, len(rows) + 1))
    assert all(0 <= row["probability_within"] <= 1 for row in rows)
    assert all(row["settings"]["tank_pressure_pa"] <= 8e5 for row in rows) and plot.is_file()
    assert all({"settings", "avoid"} <= set(row) for row in json.loads(avoid.read_text()))
    assert all(
        {"tank_pressure_pa", "tip_material"} <= set(other)
        for row in rows
        for other in row["alternatives"]
    )
    again = tune(url, tmp_path, *words)
    assert again.exit_code == 0
    table = again.stdout.splitlines()
    header = next(number for number, line in enumerate(table) if line.startswith("rank "))
    shown = dict(
        zip(re.split(r"  +", table[header]), re.split(r"  +", table[header + 1]), strict=True)
    )
    settings = rows[0]["settings"]
    assert float(shown["tank pressure (bar)"]) == pytest.approx(
        settings["tank_pressure_pa"] / 1e5, rel=1e-3
    )
    assert float(shown["tip radius (mm)"]) == pytest.approx(
        1e3 * settings["tip_radius_m"], rel=1e-3
    )
    assert shown["every line fits"] == percent(rows[0]["probability_within"])
    best = max(row["probability_within"] for row in rows)
    assert re.match(
        rf"(One proposal meets|\d+ proposals meet) the target: .* {100 * best:.0f} % ", again.stdout
    )


@pytest.mark.slow
@pytest.mark.parametrize("form", [(), ("--json",)])
def test_target_that_no_setting_meets_is_exit_code_1(url, tmp_path, form):
    (tmp_path / "spec.csv").write_text(
        "frequency_hz,level_g\n100,2000\n1000,4000000\n4000,4000000\n"
    )
    result = tune(url, tmp_path, "--tolerance", "6dB", *form)
    assert result.exit_code == 1
    said = result.stderr if form else result.stdout
    lines = said.splitlines()
    (place,) = [n for n, line in enumerate(lines) if line.startswith("No setting meets the target")]
    assert re.search(
        r"The level stands in the way: .* 8 bar, 1 kg.* dB louder.* bench sets 0\.2 to 8 bar",
        lines[place + 1],
    )
    if form:
        rows = json.loads(result.stdout)
        assert [row["rank"] for row in rows] == list(range(1, len(rows) + 1))
    else:
        assert place == 0


@pytest.mark.slow
def test_bench_that_allows_nothing_is_exit_code_1_and_no_plot(url, tmp_path):
    (tmp_path / "own.toml").write_text(
        shipped_factors("gun") + "\n[bench]\nmax_contact_force_n = 1.0\n"
    )
    plot = tmp_path / "tuned.png"
    result = tune(url, tmp_path, "--factors", tmp_path / "own.toml", "--plot", plot, "--json")
    assert result.exit_code == 1 and json.loads(result.stdout) == []
    assert (
        "expected peak force" in result.stderr
        and "allowed 1 (max_contact_force_n)" in result.stderr
    )
    assert not plot.exists()


@pytest.mark.parametrize(("words", "said"), [
    (("--bullet-mass", "0.5"), "with a unit"),
    (("--bullet-mass", "0.2:1"), "with a unit"),
    (("--measured", "nowhere"), "no campaign 'nowhere'"),
    (("--plate", "oak"), "no material 'oak'"),
])  # fmt: skip
def test_what_cannot_be_tuned_is_said_in_one_line(url, tmp_path, words, said):
    result = tune(url, tmp_path, *words)
    assert result.exit_code == 2 and said in result.stderr
    assert result.stderr.count("\n") == 1, result.stderr


# --- a thread finds what the main thread finds, and can be stopped ---
class StopError(Exception):
    """A person has enough."""


@pytest.fixture
def session(tmp_path, monkeypatch) -> TuningSession:
    """Three lines, one tip, one radius, one position: some 60 settings."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)

    monkeypatch.setattr(twins, "solved", partial(unsolved, points=1))
    text = shipped_factors("gun").replace(
        'levels = ["PLA", "aluminum", "steel"]', 'levels = ["PLA", "steel"]'
    )
    text = text.replace("levels = [30, 45, 60]", "levels = [30, 60]")
    (tmp_path / "spec.csv").write_text("frequency_hz,level_g\n200,20\n800,300\n")
    target, url = read_target(tmp_path / "spec.csv"), f"sqlite:///{tmp_path / 'lab.db'}"
    with opened(url, create=True) as store:
        search = SpectrumSearch(factors=TextFile(text=text))
        return session_of(store, url, target, search, TwinRequest(contact="hertz"))


def in_thread(session: TuningSession, step):
    results: list[object] = []

    def work() -> None:
        try:
            results.append(session.run(step))
        except Exception as error:  # noqa: BLE001 - told to the test
            results.append(error)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join(60)
    assert not thread.is_alive()
    return results[0]


def test_thread_finds_what_the_main_thread_finds_and_can_be_stopped(session):
    messages = []
    tuned = in_thread(session, lambda *step: messages.append(step))
    again = session.run()
    assert [setting_json(p.setting) for p in tuned.proposals] == [
        setting_json(p.setting) for p in again.proposals
    ]
    assert [p.probability_within for p in tuned.proposals] == [
        p.probability_within for p in again.proposals
    ]
    assert all(0 < done <= total for done, total, _ in messages)
    assert {"grid", "refined by 1.3", "refined by 1.1"} <= {what for _, _, what in messages}

    def stop(*_: object) -> None:
        raise StopError

    assert isinstance(in_thread(session, stop), StopError)


def test_ranges_of_a_plan_are_ranges_of_the_tuner() -> None:
    """Any mass of a continuous factor, and nine tips of a continuous radius."""
    text = with_ranges(
        shipped_factors("gun"), {"bullet_mass_kg": (0.2, 1), "tip_radius_mm": (30, 60)}
    )
    steel = ElasticMaterial("steel", 210e9, 0.29, 7850.0)
    space = tuning_space(
        space_from_text(text), lambda _: steel, steel, 0.05, 700.0, ("1",), BenchLimits()
    )
    assert space.impactor_mass_kg == ContinuousRange(0.2, 1.0)
    assert (space.tip_radii_m[0], space.tip_radii_m[-1], len(space.tip_radii_m)) == (0.03, 0.06, 9)
