"""Parts of a bench come out of the store as they went in."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from pyroshock.dataset.rows import gun_bench, modal_plate, stored_materials
from pyroshock.ingest.load import ingest_folder
from pyroshock.schema.benches import Gun, ModalTable
from pyroshock.twin.gun.bench import GunBench
from pyroshock.twin.setting import THESIS
from sqlalchemy import select
from support.records.campaigns import gun_campaign
from support.records.plate_folders import plate_campaign, small_plate
from support.stores.stores import opened


def test_gun_and_modal_table_come_back(tmp_path: Path) -> None:
    with opened(f"sqlite:///{tmp_path}/lab.db", create=True) as store:
        ingest_folder(store, gun_campaign(tmp_path / "gun"))
        ingest_folder(store, plate_campaign(tmp_path / "plate", recordings=1).folder)
        with store.reading() as session:
            gun = gun_bench(session.scalars(select(Gun)).one())
            plate = modal_plate(session.scalars(select(ModalTable)).one())
    assert gun == GunBench(0.0095, 0.049, 0.048, 0.9, 1.4, 1.4, 0.5)
    assert (plate.sensors, plate.impact_points) == (small_plate().sensors, small_plate().impact_points)
    for name in ("frequency_hz", "damping_ratio", "shape_impact", "shapes"):
        np.testing.assert_allclose(getattr(plate, name), getattr(small_plate(), name), rtol=1e-9)


def test_materials_go_by_name_and_alias_in_any_case(tmp_path: Path) -> None:
    with opened(f"sqlite:///{tmp_path}/lab.db", create=True) as store, store.reading() as session:
        materials = stored_materials(session)
    assert materials["pla"] == THESIS["PLA"]
    assert materials["aluminium"] == materials["aluminum"] == THESIS["aluminum"]
