"""The velocity of an impact is headed by what it is: an integrated one is a change of velocity."""

from __future__ import annotations

import pytest
from pyroshock.app.common.quantities import heading, velocities_of, velocity_label
from pyroshock.schema.velocity_kinds import BEFORE_CONTACT, INTEGRATED, TARGET_MOTION_ADDED

KEY = "impact_velocity_m_s"


def rows(*kinds: str | None) -> list[dict[str, object]]:
    return [{KEY: None if kind is None else 1.5, "velocity_kind": kind} for kind in kinds]


@pytest.mark.parametrize(
    ("kinds", "label"),
    [
        ((BEFORE_CONTACT, None), "impact velocity (m/s)"),
        ((INTEGRATED, INTEGRATED, None), "velocity change of the impactor by integration (m/s)"),
        ((TARGET_MOTION_ADDED,), "impact velocity by integration, with the target's motion (m/s)"),
        (
            (INTEGRATED, BEFORE_CONTACT),
            "velocity: before contact or change by integration (see velocity kind) (m/s)",
        ),
        ((None,), "impact velocity (m/s)"),
    ],
)
def test_heading_says_how_the_velocity_was_obtained(
    kinds: tuple[str | None, ...], label: str
) -> None:
    with velocities_of(rows(*kinds)):
        assert heading(KEY) == label
    assert heading(KEY) == "impact velocity (m/s)"
    assert velocity_label(kinds) in label
