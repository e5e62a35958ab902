"""The peer of the ingest, as a program: `python -m benchmarks.peer FOLDER FILE.h5` only reads and writes the series."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

CHANNELS = ("force", "acceleration")


def copy_recordings(folder: Path, target: Path) -> None:
    """Every recording of a campaign `folder`, its channels with gzip and shuffle in one HDF5 file."""
    import h5py

    with h5py.File(target, "w") as out:
        for path in sorted((folder / "recordings").iterdir()):
            group = out.create_group(path.name)
            recording = _read(path)
            for name in CHANNELS:
                group.create_dataset(name, data=recording[name].reshape(-1), compression="gzip", shuffle=True)


def _read(path: Path) -> Mapping[str, Any]:
    import numpy as np
    from scipy.io import loadmat

    return np.load(path) if path.suffix == ".npz" else loadmat(path)


if __name__ == "__main__":
    copy_recordings(Path(sys.argv[1]), Path(sys.argv[2]))
