"""Peers in environments of their own: `python -m benchmarks.peer_programs endaq|gpy|qcodes FILES…`
(`harness.Program`).

Each may need other versions than ours, so that its data comes as files, and nothing of ours but the
harness is imported.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from .harness import Message, answer_requests, wall_seconds


def endaq(file: str) -> Callable[[Message], Message]:
    """endaq's shock response spectrum of an acceleration."""
    import pandas as pd
    from endaq.calc.shock import shock_spectrum

    given = np.load(file)
    record, rate, zeta = given["record"], float(given["rate_hz"]), float(given["damping_ratio"])
    table = pd.DataFrame({"a": record}, index=pd.Index(np.arange(record.size) / rate, name="time"))

    def spectrum() -> pd.DataFrame:
        result: pd.DataFrame = shock_spectrum(table, given["lines_hz"], damp=zeta, mode="srs")
        return result

    def answer(request: Message) -> Message:
        return (
            {"value": spectrum()["a"].tolist()}
            if request.get("value")
            else {"seconds": wall_seconds(spectrum)}
        )

    return answer


class CoregionalizedRegression:
    """GPy's own model of many outputs: a row for each output of each pulse, a kernel times a
    `Coregionalize`, and a noise for each output."""

    def __init__(self, file: str) -> None:
        import GPy

        given = np.load(file)
        x, y, self._asked = given["x"], given["y"], given["asked"]
        d, m = x.shape[1], y.shape[1]
        rbf = GPy.kern.RBF(d, variance=1.0, lengthscale=given["lengthscales"], ARD=True)
        loadings, kappa = given["loadings"], given["kappa"]
        kernel = GPy.util.multioutput.ICM(
            d, m, rbf, W_rank=loadings.shape[1], W=loadings, kappa=kappa
        )
        noises = [
            GPy.likelihoods.Gaussian(variance=v, name=f"noise_{j}")
            for j, v in enumerate(given["noise"])
        ]
        self._model: Any = GPy.models.GPCoregionalizedRegression(
            [x] * m, [y[:, [j]] for j in range(m)], kernel=kernel, likelihoods_list=noises
        )
        self._outputs = m
        self._vector = np.array(self._model.optimizer_array)

    def likelihood(self) -> Message:
        """As its optimiser asks: parameters in, loss and gradient out."""
        self._model.optimizer_array = self._vector
        value = float(self._model.objective_function())
        self._model.objective_function_gradients()
        return {"value": value}

    def prediction(self) -> Message:
        n, m = len(self._asked), self._outputs
        output = np.repeat(np.arange(m), n)[:, None]
        at = np.hstack([np.tile(self._asked, (m, 1)), output])
        mean, variance = self._model.predict(at, Y_metadata={"output_index": output})
        return {
            "mean": mean.reshape(m, n).T.tolist(),
            "spread": np.sqrt(variance).reshape(m, n).T.tolist(),
        }


def gpy(folder: str) -> Callable[[Message], Message]:
    model = lru_cache(lambda n: CoregionalizedRegression(f"{folder}/pulses-{n}.npz"))

    def answer(request: Message) -> Message:
        evaluate = getattr(model(request["n"]), request["what"])
        begin = time.perf_counter()
        result = evaluate()
        return {"seconds": time.perf_counter() - begin, **result}

    return answer


class QcodesDataset:
    """A recording is a run of an experiment, a channel an array of it, a pulse another one; factors
    are its metadata, which QCoDeS keeps as columns of its table of runs. There are no arrays of set
    points: a series has a rate, and its times would take its room again."""

    def __init__(self, content: Path, folder: Path, factor: str) -> None:
        self._folder, self._factor, self._number = folder, factor, 0
        self._experiment: Any = None
        self._index = json.loads((content / "index.json").read_text())
        self._arrays = [dict(np.load(content / f"{row['run']}.npz")) for row in self._index]

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

        for row, arrays in zip(self._index, self._arrays, strict=True):
            measurement = Measurement(exp=self._experiment, name=str(row["run"]))
            for name in arrays:
                measurement.register_custom_parameter(name, paramtype="array")
            with measurement.run() as saver:
                saver.add_result(*arrays.items())
                for tag, value in (
                    *row["attributes"].items(),
                    ("impacts", json.dumps(row["impacts"])),
                ):
                    saver.dataset.add_metadata(tag, value)

    def whole(self, run: int) -> np.ndarray[Any, Any]:
        from qcodes.dataset import load_by_id

        data = load_by_id(
            run, self._experiment.conn
        )  # runs are numbered from 1, as the campaign's are
        return np.asarray(data.get_parameter_data("force")["force"]["force"]).reshape(-1)

    def window(self, run: int, start: int, stop: int) -> np.ndarray[Any, Any]:
        """An array is stored as one value."""
        return self.whole(run)[start:stop]

    def pulses(self, level: str) -> list[np.ndarray[Any, Any]]:
        from qcodes.dataset import load_by_id

        where = f"WHERE {self._factor} = ?"
        # The factor is our own word.
        query = f"SELECT run_id FROM runs {where} ORDER BY run_id"  # noqa: S608
        pulses = []
        for (key,) in self._experiment.conn.execute(query, (level,)):
            data = load_by_id(key, self._experiment.conn)
            names = [
                p.name for p in data.get_parameters() if p.name.startswith("pulse_")
            ]  # in no order
            names.sort(key=lambda name: int(name.removeprefix("pulse_")))
            arrays = data.get_parameter_data(*names)
            pulses += [np.asarray(arrays[name][name]).reshape(-1) for name in names]
        return pulses


def qcodes(content: str, folder: str, factor: str) -> Callable[[Message], Message]:
    import qcodes as package

    package.config.user.mainfolder = folder
    dataset = QcodesDataset(Path(content), Path(folder), factor)

    def answer(request: Message) -> Message:
        begin = time.perf_counter()
        result = getattr(dataset, request["what"])(*request["of"])
        seconds = time.perf_counter() - begin
        arrays = [] if result is None else [result] if isinstance(result, np.ndarray) else result
        return {
            "seconds": seconds,
            "sums": [[len(x), float(np.sum(x, dtype=np.float64))] for x in arrays],
        }

    return answer


PROGRAMS: dict[str, Callable[..., Callable[[Message], Message]]] = {
    "endaq": endaq,
    "gpy": gpy,
    "qcodes": qcodes,
}

if __name__ == "__main__":
    answer_requests(PROGRAMS[sys.argv[1]](*sys.argv[2:]))
