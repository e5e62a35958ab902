"""The gun and the five shots of Table 3.1, as they ship with the software."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from pyroshock.ingest.folder.campaign_file import read_campaign_file
from pyroshock.ingest.load import ingest_folder
from pyroshock.schema.listings import iter_shots
from pyroshock.schema.session import Writer, open_store
from pyroshock.twin.gun.nominal import GunBench

FOLDER = Path(__file__).resolve().parents[1] / "first-shots"


def gun() -> GunBench:
    """The thesis's gun, by the [bench.gun] of campaign.toml."""
    part = read_campaign_file(FOLDER).gun
    assert part is not None  # the shipped campaign has one
    return GunBench(**vars(part))


def shots() -> list[dict[str, Any]]:
    """The shots as the store lists them, SI, in order of pressure; their uncertainty is that of eq.
    5.2."""
    with (
        TemporaryDirectory() as folder,
        open_store(f"sqlite:///{folder}/shots.db", Writer("gallery", "0"), create=True) as store,
    ):
        ingest_folder(store, FOLDER, jobs=1)
        with store.reading() as session:
            found = list(iter_shots(session, "first-shots"))
    return sorted(found, key=lambda shot: float(shot["tank_pressure_pa"]))
