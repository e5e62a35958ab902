"""`python -m examples.virtual_campaigns --out FOLDER`: the campaigns of the virtual bench that the
demo reads, made anew from their plans and seeds."""

from __future__ import annotations

import argparse
import csv
import shutil
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from pyroshock import __version__
from pyroshock.app.demo.virtual_campaign import (
    CHANGED,
    REHEARSAL,
    VirtualCampaign,
    make_campaign_plan,
    simulate_runs,
)
from pyroshock.schema.session import Writer, open_store
from pyroshock.virtualbench.recorder import open_seal

from .packing import pack

#: Of the store that holds a plan while its runs are simulated.
WRITER = Writer("python -m examples.virtual_campaigns", __version__)


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("examples"))
    options = parser.parse_args(arguments)
    for campaign in (REHEARSAL, CHANGED):
        size = make(campaign, options.out / campaign.name)
        sys.stdout.write(f"{options.out / campaign.name}: {size / 1e6:.1f} MB of recordings\n")
    return 0


def make(campaign: VirtualCampaign, out: Path) -> int:
    """Simulate the runs of a campaign that the demo does not fire itself, and store them small in
    `out`; returns the bytes of the recordings."""
    with TemporaryDirectory() as work:
        url = f"sqlite:///{Path(work) / 'plan.db'}"
        with open_store(url, WRITER, create=True) as store:
            plan = make_campaign_plan(store, campaign)
        runs = campaign.shipped_runs(plan)
        simulated = simulate_runs(plan, campaign, runs, Path(work) / campaign.name)
        recordings = out / "recordings"
        if recordings.is_dir():  # of an earlier call
            shutil.rmtree(recordings)
        impacts: Mapping[str, Any] = {
            run["recording"]: run["hits"][0]["start_s"] for run in open_seal(simulated.seal).runs
        }
        for name, impact_s in impacts.items():
            with np.load(simulated.folder / name) as archive:
                channels = {key: archive[key] for key in archive.files if key != "fs"}
            pack(channels, impact_s, (out / name).with_suffix(".h5"))
        shutil.copy2(simulated.folder / "campaign.toml", out)
        _write_runs(simulated.folder / "runs.csv", out / "runs.csv")
    return sum(path.stat().st_size for path in recordings.iterdir())


def _write_runs(simulated: Path, runs: Path) -> None:
    """The rows of runs.csv with the names of the packed recordings."""
    with simulated.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    with runs.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        for row in rows:
            writer.writerow(row | {"recording": str(Path(row["recording"]).with_suffix(".h5"))})


if __name__ == "__main__":
    sys.exit(main())
