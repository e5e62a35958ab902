"""The coregional process as GPy has it: `python -m benchmarks.gpy_peer`, which answers what it is asked (`apart`).

GPy may need an environment of its own, so pulses and parameters come as a file (`coregional_ways.written`), and
nothing of ours is imported. GPy's own way to many outputs is a row for each output of each pulse, a kernel times a
`Coregionalize`, and a noise for each output.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from .apart import Answer, answering


class Model:
    def __init__(self, file: str) -> None:
        import GPy

        given = np.load(file)
        x, y, self._asked = given["x"], given["y"], given["asked"]
        d, m = x.shape[1], y.shape[1]
        rbf = GPy.kern.RBF(d, variance=1.0, lengthscale=given["lengthscales"], ARD=True)
        loadings, kappa = given["loadings"], given["kappa"]
        kernel = GPy.util.multioutput.ICM(d, m, rbf, W_rank=loadings.shape[1], W=loadings, kappa=kappa)
        variances = given["noise"]
        noises = [GPy.likelihoods.Gaussian(variance=v, name=f"noise_{j}") for j, v in enumerate(variances)]
        self._model: Any = GPy.models.GPCoregionalizedRegression(
            [x] * m, [y[:, [j]] for j in range(m)], kernel=kernel, likelihoods_list=noises
        )
        self._outputs = m
        self._vector = np.array(self._model.optimizer_array)

    def likelihood(self) -> dict[str, Any]:
        """As its optimiser asks: parameters in, loss and gradient out."""
        self._model.optimizer_array = self._vector
        value = float(self._model.objective_function())
        self._model.objective_function_gradients()
        return {"value": value}

    def prediction(self) -> dict[str, Any]:
        n, m = len(self._asked), self._outputs
        output = np.repeat(np.arange(m), n)[:, None]
        at = np.hstack([np.tile(self._asked, (m, 1)), output])
        mean, variance = self._model.predict(at, Y_metadata={"output_index": output})
        return {"mean": mean.reshape(m, n).T.tolist(), "spread": np.sqrt(variance).reshape(m, n).T.tolist()}


def main() -> None:
    models: dict[str, Model] = {}

    def answer(request: Answer) -> Answer:
        file = request["file"]
        if file not in models:
            models[file] = Model(file)
        begin = time.perf_counter()
        found = getattr(models[file], request["what"])()
        return {"seconds": time.perf_counter() - begin, **found}

    answering(answer)


if __name__ == "__main__":
    main()
