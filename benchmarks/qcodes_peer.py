"""QCoDeS' data set as a way of keeping a campaign: `python -m benchmarks.qcodes_peer CONTENT FOLDER` (`apart`).

QCoDeS may need an environment of its own, so recordings come as files (`stored_content.written`), and nothing of ours
is imported. A recording is a run of an experiment, a channel an array of it, a pulse another one; factors are its
metadata, which QCoDeS keeps as columns of its table of runs. There are no arrays of set points: a series has a rate,
and its times would take its room again.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from .apart import Answer, answering


class Kept:
    def __init__(self, content: Path, folder: Path) -> None:
        self._folder = folder
        self._number = 0
        self._experiment: Any = None
        self._index = json.loads((content / "index.json").read_text())
        self._arrays = [dict(np.load(content / f"{one['run']}.npz")) for one in self._index]

    def empty(self) -> None:
        """A new database: QCoDeS keeps the old one open."""
        from qcodes.dataset import initialise_or_create_database_at, load_or_create_experiment

        if self._experiment is not None:
            self._experiment.conn.close()
        for old in self._folder.iterdir():
            old.unlink()
        self._number += 1
        initialise_or_create_database_at(self._folder / f"campaign-{self._number}.db")
        self._experiment = load_or_create_experiment("measured", sample_name="plate")

    def store(self) -> None:
        from qcodes.dataset import Measurement

        for one, arrays in zip(self._index, self._arrays, strict=True):
            measurement = Measurement(exp=self._experiment, name=str(one["run"]))
            for name in arrays:
                measurement.register_custom_parameter(name, paramtype="array")
            with measurement.run() as saver:
                saver.add_result(*arrays.items())
                metadata = {"rate_hz": one["rate_hz"], "path": one["path"], **one["factors"]}
                for tag, value in metadata.items():
                    saver.dataset.add_metadata(tag, value)
                saver.dataset.add_metadata("impacts", json.dumps(one["impacts"]))

    def whole(self, run: int) -> np.ndarray[Any, Any]:
        return self._array(run, "force")

    def window(self, run: int, start: int, stop: int) -> np.ndarray[Any, Any]:
        """Of the array that a row holds, for it is stored as one."""
        return self._array(run, "force")[start:stop]

    def pulses(self, factor: str, level: str) -> list[np.ndarray[Any, Any]]:
        from qcodes.dataset import load_by_id

        query = f"SELECT run_id FROM runs WHERE {factor} = ? ORDER BY run_id"  # noqa: S608 - the factor is our own word
        keys = [key for (key,) in self._experiment.conn.execute(query, (level,))]
        found = []
        for key in keys:
            data = load_by_id(key, self._experiment.conn)
            names = [p.name for p in data.get_parameters() if p.name.startswith("pulse_")]  # in no order
            names.sort(key=lambda name: int(name.removeprefix("pulse_")))
            got = data.get_parameter_data(*names)
            found += [np.asarray(got[name][name]).reshape(-1) for name in names]
        return found

    def room(self) -> int:
        return sum(file.stat().st_size for file in self._folder.iterdir())

    def _array(self, run: int, name: str) -> np.ndarray[Any, Any]:
        from qcodes.dataset import load_by_id

        data = load_by_id(run, self._experiment.conn)  # runs are numbered from 1, as the campaign's are
        return np.asarray(data.get_parameter_data(name)[name][name]).reshape(-1)


def main(content: Path, folder: Path) -> None:
    import qcodes

    qcodes.config.user.mainfolder = str(folder)
    kept = Kept(content, folder)

    def answer(request: Answer) -> Answer:
        ask: Callable[..., Any] = getattr(kept, request["what"])
        begin = time.perf_counter()
        found = ask(*request["of"])
        seconds = time.perf_counter() - begin
        arrays = [] if found is None else [found] if isinstance(found, np.ndarray) else found
        if isinstance(found, int):
            return {"seconds": seconds, "bytes": found}
        return {"seconds": seconds, "sums": [[len(x), float(np.sum(x, dtype=np.float64))] for x in arrays]}

    answering(answer)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
