"""Random answers of searches and validations, as their jobs keep them."""

from __future__ import annotations

from typing import Any

from hypothesis import strategies as st

LINES = [100.0, 1000.0, 10_000.0]
SHARES = st.sampled_from((0.0, 0.0149, 0.015, 0.4975, 0.5, 0.995, 1.0)) | st.floats(0.0, 1.0)
DECIBELS = st.floats(-40.0, 40.0).map(lambda value: round(value, 6))
LEVELS = st.lists(st.floats(1.0, 1e6), min_size=3, max_size=3)
OBSTACLE = "The shape stands in the way."
NAMES = ("velocity", "peak_force", "impulse", "peak_acceleration_acceleration_1", "srs_top")


@st.composite
def proposals(draw: st.DrawFn) -> dict[str, Any]:
    settings = {
        "tank_pressure_pa": draw(st.floats(2e4, 8e5)),
        "bullet_mass_kg": draw(st.floats(0.05, 2.0)),
        "tip_material": draw(st.sampled_from(("steel", "PLA"))),
        "tip_radius_m": draw(st.floats(0.01, 0.1)),
        "plate_material": "aluminum",
        "anvil_material": draw(st.sampled_from(("none", "steel"))),
        "insulator": draw(st.sampled_from(("none", "felt"))),
        "impact_position": "#A",
    }
    has_edge = draw(st.booleans())
    return {
        "settings": settings,
        "probability_met": draw(SHARES),
        "probability_within": draw(SHARES),
        "probability_95_percent_within": draw(SHARES),
        "share_within": draw(SHARES),
        "worst_margin_db": draw(DECIBELS) if has_edge else None,
        "worst_frequency_hz": draw(st.sampled_from(LINES)),
        "expected_m_s2": draw(LEVELS),
        "alternatives": [],
    }


@st.composite
def searches(draw: st.DrawFn) -> dict[str, Any]:
    rows = draw(st.lists(proposals(), max_size=4))
    required = draw(st.sampled_from((0.5, 1.0)) | st.floats(0.001, 1.0))
    meeting = sum(row["probability_met"] >= required for row in rows)
    obstacle = {
        "kind": draw(st.sampled_from(("shape", "tolerance", "measured shots"))),
        "sentence": OBSTACLE,
        "probability_without": draw(SHARES),
        "frequency_hz": draw(st.sampled_from(LINES)),
        "margin_db": draw(DECIBELS),
        "limits": [],
        "shot_scatter_db": draw(st.none() | st.floats(0.1, 5.0)),
    }
    return {
        "draws": draw(st.none() | st.integers(20, 1000)),
        "attainability": {
            "meets": bool(meeting),
            # older software has called the largest of all the best
            "probability": max((row["probability_met"] for row in rows), default=0.0),
            "at_least": required,
            "meeting": meeting,
            "lines": "every line of the next shot lies within tolerance",
            "obstacle": None if meeting else obstacle,
        },
        "proposals": [{"rank": rank, **row} for rank, row in enumerate(rows, 1)],
        "avoid": [],
        "frequency_hz": LINES,
        "prescribed_m_s2": draw(LEVELS),
    }


@st.composite
def scores(draw: st.DrawFn, name: str) -> dict[str, Any]:
    values = draw(st.integers(1, 300))
    return {
        "name": name,
        "unit": "dB" if name.startswith("srs_") else "ln",
        "shots": values,
        "configurations": draw(st.integers(1, values)),
        "values": values,
        "effective_values": draw(st.floats(1.0, values)),
        "coverage50": draw(st.floats(0.0, 1.0)),
        "coverage90": draw(st.sampled_from((0.0, 1.0, 0.9)) | st.floats(0.6, 1.0)),
        "median_abs_error": draw(st.floats(0.0, 3.0)),
        "bias": draw(st.floats(-1.0, 1.0)),
        "sharpness90": draw(st.floats(0.01, 3.0)),
        "crps": draw(st.floats(0.001, 1.0)),
    }


@st.composite
def validations(draw: st.DrawFn) -> dict[str, Any]:
    names = draw(st.lists(st.sampled_from(NAMES), min_size=1, unique=True))
    return {"quantities": [draw(scores(name)) for name in names]}
