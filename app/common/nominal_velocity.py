"""The nominal gun's velocity beside each stored shot."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from sqlalchemy.orm import Session

from ...dataset.rows import gun_bench
from ...schema.benches import Gun
from ...twin.gun.nominal import GunBench, muzzle_velocity


def with_predictions(session: Session, shots: Iterable[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    """Each shot with `predicted_velocity_m_s` by eq. 2.16 and 2.18 for its campaign's gun; None
    without a gun."""
    benches: dict[int | None, GunBench | None] = {None: None}
    for shot in shots:
        gun = shot.pop("gun_id")
        if gun not in benches:
            benches[gun] = gun_bench(session.get_one(Gun, gun))
        bench = benches[gun]
        predicted = None
        if bench is not None:
            predicted = float(
                muzzle_velocity(bench, shot["tank_pressure_pa"], shot["bullet_mass_kg"])
            )
        yield {**shot, "predicted_velocity_m_s": predicted}
