"""A campaign folder as a record, by an ingest into a store that is gone afterwards."""

from __future__ import annotations

import tempfile
from pathlib import Path

from ...schema.session import Writer, open_store
from ..record import CampaignRecord
from .campaign import read_campaign

#: Folders above this are ingested into a file of a temporary folder, not into memory.
IN_MEMORY_BYTES = 256 * 2**20


def read_folder(path: Path) -> CampaignRecord:
    """The campaign in the folder `path`, as `read_campaign` gives it. Leaves nothing behind.

    Raises `IngestError` for a folder that the ingest refuses.
    """
    from ...ingest.load import ingest_folder

    path = Path(path)
    large = sum(file.stat().st_size for file in path.rglob("*") if file.is_file()) > IN_MEMORY_BYTES
    with tempfile.TemporaryDirectory(prefix="pyroshock-") as scratch:
        url = f"sqlite:///{scratch}/campaign.db" if large else "sqlite:///:memory:"
        with open_store(url, Writer("diagnose", "temporary"), create=True) as store:
            report = ingest_folder(store, path, jobs=None if large else 1)
            with store.reading() as session:
                return read_campaign(session, report.campaign)
