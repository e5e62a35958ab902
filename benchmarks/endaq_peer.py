"""endaq's shock response spectrum: `python -m benchmarks.endaq_peer FILE.npz`, which answers requests (`apart`).

What endaq stands on installs a package named `tests`, hence an environment of its own; nothing of ours is imported.
"""

from __future__ import annotations

import sys

import numpy as np

from .apart import Answer, answering, seconds_of


def main(file: str) -> None:
    import pandas as pd
    from endaq.calc.shock import shock_spectrum

    given = np.load(file)
    record, rate, zeta = given["record"], float(given["rate_hz"]), float(given["damping_ratio"])
    table = pd.DataFrame({"a": record}, index=pd.Index(np.arange(record.size) / rate, name="time"))

    def spectrum() -> pd.DataFrame:
        found: pd.DataFrame = shock_spectrum(table, given["lines_hz"], damp=zeta, mode="srs")
        return found

    def answer(request: Answer) -> Answer:
        if request.get("value"):
            return {"value": spectrum()["a"].tolist()}
        return {"seconds": seconds_of(spectrum)}

    answering(answer)


if __name__ == "__main__":
    main(sys.argv[1])
