"""A hammer campaign of Table 4.1 on the virtual bench, recorded and ingested.

The thesis's own recordings do not come with it.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pyroshock.dataset.snapshot import build_snapshot
from pyroshock.dataset.table import PulseTable
from pyroshock.doe.designs.factorial import factorial
from pyroshock.doe.space import hammer_space
from pyroshock.ingest.extraction.channels import read_channels
from pyroshock.ingest.folder.campaign_file import read_campaign_file
from pyroshock.ingest.load import ingest_folder
from pyroshock.schema.impacts import Impact, Pulse
from pyroshock.schema.session import Store, Writer, open_store
from pyroshock.signals.channel import Channel
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.recorder import open_seal, seal_path
from pyroshock.virtualbench.simulate import simulate
from sqlalchemy import select

#: From what changes seldom to what changes always. The thesis lists no order, but tells of groups
#: of six tests with one tip material, in the order of Table 4.1 (section 4.1).
_ORDER = (
    *("boundary_conditions", "anvil_material", "insulator", "tip_material"),
    *("hammer_speed", "impact_position"),
)
SEED = 1

Rows = Sequence[Mapping[str, str]]


@dataclass(frozen=True)
class HammerCampaign:
    """A campaign folder, and beside it its store; `rows` are its tests, of `hits` hits each."""

    folder: Path
    rows: Rows
    hits: int

    @property
    def note(self) -> str:
        """What every picture of it says."""
        return (
            f"Virtual campaign, {len(self.rows)} tests of {self.hits} hits: not "
            f"the thesis's recordings"
        )

    @property
    def tests(self) -> NDArray[np.int64]:
        """Their numbers, in order."""
        return np.array([int(row["run"]) for row in self.rows])

    def tests_with(self, tip: str) -> NDArray[np.int64]:
        """The numbers of those with this tip material."""
        return self.tests[[row["tip_material"] == tip for row in self.rows]]

    @contextmanager
    def store(self) -> Iterator[Store]:
        with open_store(
            f"sqlite:///{self.folder}.db", Writer("gallery", "0"), create=True
        ) as store:
            yield store

    def pulses(self, *columns: str) -> dict[str, NDArray[Any]]:
        """Columns of the stored pulses, (n,) in order of test and hit, with `run` and
        `repetition`."""
        query = (
            select(Impact.run, Impact.repetition, *(getattr(Pulse, name) for name in columns))
            .join(Pulse, Pulse.impact_id == Impact.id)
            .where(Pulse.current)
            .order_by(Impact.run, Impact.repetition)
        )
        with self.store() as store, store.reading() as session:
            rows = session.execute(query).all()
        return dict(
            zip(
                ("run", "repetition", *columns), map(np.array, zip(*rows, strict=True)), strict=True
            )
        )

    def table(self) -> PulseTable:
        """The pulses with the 13 predictors of Table 4.3, frozen as a dataset."""
        with self.store() as store:
            return build_snapshot(
                store, "gallery", [read_campaign_file(self.folder).name]
            ).snapshot.table

    def channels(self, test: int) -> dict[str, Channel]:
        """The recording of a test, by channel."""
        sensors = read_campaign_file(self.folder).sensors
        found, _ = read_channels(self.folder / "recordings" / f"{test:04d}.npz", sensors)
        return {channel.name: channel for channel in found}

    def truth(self) -> dict[int, Sequence[Mapping[str, Any]]]:
        """What really happened in each hit, by test, from the sealed envelope."""
        return {run["run"]: run["hits"] for run in open_seal(seal_path(self.folder)).runs}


def tests_in_order() -> list[dict[str, str]]:
    """The 180 tests of Table 4.1, numbered from 1."""
    space = hammer_space()
    levels = {factor.column: factor.levels for factor in space.factors}
    rows = sorted(
        factorial(space).rows, key=lambda row: [levels[name].index(row[name]) for name in _ORDER]
    )
    return [{"run": str(number), **row} for number, row in enumerate(rows, 1)]


def recorded(
    work: Path, hits: int, rows: Rows | None = None, jobs: int | None = None
) -> HammerCampaign:
    """The campaign of these tests (all 180), in a folder of `work`; recorded and ingested where it
    is not there yet."""
    rows = tests_in_order() if rows is None else rows
    campaign = HammerCampaign(work / f"hammer-{len(rows)}x{hits}", rows, hits)
    if not (campaign.folder / "campaign.toml").is_file():
        logging.getLogger(__name__).info(
            "recording %d tests of %d hits in %s", len(rows), hits, campaign.folder
        )
        effects = Effects.default()
        simulate(
            rows, "hammer", campaign.folder, seed=SEED, effects=effects, repetitions=hits, jobs=jobs
        )
    with campaign.store() as store:
        ingest_folder(store, campaign.folder, jobs=jobs)  # twice adds nothing
    return campaign
