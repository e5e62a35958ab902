"""The height at which the plate hangs: a pendulum by its own motion, what the bench allows, and a
factor of plans."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from pyroshock.doe.guards import (
    PlannedShot,
    UnsafeRunError,
    check_run,
    planned_shots,
    refuse_unsafe,
)
from pyroshock.doe.limits.bench import MAX_CHAIN_LOAD_N, TABLE_2_1, BenchLimits, Swing, read_limits
from pyroshock.doe.limits.contact_force import Elastic
from pyroshock.doe.toml_space import parse
from pyroshock.schema.known_factors import LevelError, level_of
from scipy.integrate import solve_ivp

BENCH = BenchLimits(pendulum_length_m=0.9)
SHOT = PlannedShot("4", 1e5, 0.5, 10.0, "steel", peak_force_n=5e4)


@pytest.mark.parametrize("momentum", [0.5, 5.0, 20.0])
def test_swing_and_load_are_those_of_the_pendulum_s_motion(momentum: float) -> None:
    """theta'' = -g / l sin theta from 2 p / (M l) at rest: its reach, and its tension M (g cos + l
    theta'^2)."""
    swing = Swing(0.8, 23.4, momentum)
    start = [0.0, 2 * momentum / (23.4 * 0.8)]

    def top(_: float, state: np.ndarray) -> float:
        return state[1]

    top.terminal = True  # type: ignore[attr-defined]
    run = solve_ivp(
        lambda _, s: [s[1], -9.80665 / 0.8 * math.sin(s[0])],
        (0, 10),
        start,
        events=top,
        rtol=1e-10,
        atol=1e-12,
    )
    angle = run.y[0]
    assert swing.reach_m == pytest.approx(0.8 * math.sin(angle[-1]), rel=1e-6)
    tension = 23.4 * (9.80665 * np.cos(angle) + 0.8 * run.y[1] ** 2)
    assert swing.chain_load_n == pytest.approx(tension.max(), rel=1e-9)


def test_the_heaviest_plate_hangs_within_table_2_1() -> None:
    # Steel, 2000 x 1000 x 50 mm, around 800 kg, struck by 80 kg m/s (section 2.1.1): 7765 N are
    # printed.
    load = Swing(0.9, 7800 * 2.0 * 1.0 * 0.05, 80.0).chain_load_n
    assert load == pytest.approx(7765.0, rel=0.02)
    assert load < MAX_CHAIN_LOAD_N == pytest.approx(30901 / 3.9)
    assert all(part.rated_load_n / MAX_CHAIN_LOAD_N >= 3.9 - 1e-12 for part in TABLE_2_1[:3])
    assert Swing(0.5, 20.0, 60.0).rise_m > 0.5
    assert Swing(0.5, 20.0, 60.0).reach_m == 0.5
    high, low = (Swing(0.9 - height, 23.4, 10.0) for height in (0.168, -0.168))
    assert high.reach_m < low.reach_m
    assert high.chain_load_n > low.chain_load_n


@pytest.mark.parametrize(
    ("limits", "height", "names"),
    [
        ({}, 0.112, []),
        ({"max_swing_m": 0.1}, 0.0, ["max_swing_m"]),
        ({"max_chain_load_n": 240.0}, 0.0, []),
        ({"max_chain_load_n": 240.0}, 0.56, ["max_chain_load_n"]),
        ({"strike_to_lower_edge_m": 0.19}, 0.168, ["strike_to_lower_edge_m"]),
        ({"strike_to_lower_edge_m": 0.20}, 0.168, []),
        ({"strike_to_upper_edge_m": 0.19}, -0.168, ["strike_to_upper_edge_m"]),
        ({"strike_to_upper_edge_m": 0.19}, 0.168, []),
    ],
)
def test_guard_holds_the_suspension_against_the_bench(
    limits: dict[str, float], height: float, names: list[str]
) -> None:
    found = check_run(replace(SHOT, chain_height_m=height), replace(BENCH, **limits))
    assert [item.limit for item in found] == names


def test_a_height_needs_the_pendulum_s_length() -> None:
    with pytest.raises(
        ValueError, match="run 4: chain_height_mm is 56, which changes how the plate swings; state"
    ):
        check_run(replace(SHOT, chain_height_m=0.056), BenchLimits())
    assert check_run(SHOT, BenchLimits()) == []
    with pytest.raises(
        ValueError,
        match="run 4: chain_height_mm is 952; expected less than pendulum_length_m, 900 mm",
    ):
        check_run(replace(SHOT, chain_height_m=0.952), BENCH)


ROW = {
    "run": "7", "plate_material": "steel", "anvil_material": "none", "tip_material": "steel",
    "tip_radius_mm": "45",
    "bullet_mass_kg": "0.5", "velocity_level": "medium",
}  # fmt: skip


def planned(**cells: str) -> PlannedShot:
    steel = {"steel": Elastic(200e9, 0.3)}
    (shot,) = planned_shots([ROW | cells], {"medium": 10.0}, {("medium", 0.5): 1e5}, steel)
    return shot


def test_a_plan_s_row_is_judged_at_its_height() -> None:
    assert planned().chain_height_m == planned(chain_height_mm="").chain_height_m == 0.0
    shot = planned(chain_height_mm="-112")
    assert shot.chain_height_m == pytest.approx(-0.112)
    limits = read_limits({"pendulum_length_m": 0.9, "max_swing_m": 0.1})
    refuse_unsafe([planned(chain_height_mm="448")], limits)
    with pytest.raises(
        UnsafeRunError, match=r"run 7: swing of the plate .* m, allowed 0\.1 \(max_swing_m\)"
    ):
        refuse_unsafe([shot], limits)
    with pytest.raises(
        ValueError,
        match=r"run 7: chain_height_mm is '50'; expected a multiple of 56, such as -56 or 0",
    ):
        planned(chain_height_mm="50")


FACTORS = """
name = "heights"
kind = "gun"
[[factors]]
name = "chain_height"
column = "chain_height_mm"
kind = "numeric"
unit = "mm"
levels = [-56, 0, {}]
change = 3
"""


def test_chain_height_is_in_whole_links() -> None:
    (factor,) = parse(FACTORS.format(112)).factors
    assert factor.numbers == (-56.0, 0.0, 112.0)
    with pytest.raises(
        ValueError, match="chain_height_mm has level '100'; expected a multiple of 56"
    ):
        parse(FACTORS.format(100))
    level = level_of("chain_height_mm", "-112", lambda _: None)
    assert (level.factor, level.number, level.si_unit) == (
        "chain_height",
        pytest.approx(-0.112),
        "m",
    )
    for text in ("60", "a link"):
        with pytest.raises(LevelError, match="a multiple of 56"):
            level_of("chain_height_mm", text, lambda _: None)
