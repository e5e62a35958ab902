"""What a version is said to need is what its kind imports."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from pyroshock.training.models.catalogue import BuildOptions, entry_of
from pyroshock.training.models.serialization import KINDS, describe
from pyroshock.training.registry.logged import TO_FIT, TO_PREDICT, _libraries, requirements

#: A process of its own for each model: it trains, says which libraries were imported for it, and
#: hands the model over.
FIT = """
import json, pickle, sys
from pathlib import Path
import numpy as np
sys.path.insert(0, sys.argv[1])
from support.records.pulse_tables import pulse_table
from pyroshock.training.models.serialization import pack
from pyroshock.training.models.catalogue import BuildOptions, entry_of
pulses = pulse_table(np.random.default_rng(1), repetitions=2)
imported = set(sys.modules)
model = entry_of(sys.argv[2]).make(BuildOptions())
small = {"population": 2, "generations": 1, "iterations": 1, "search_rows": 40}
for part in vars(getattr(model, "model", model)).values():
    for name, few in small.items():
        if hasattr(part, name):
            setattr(part, name, few)
model.fit(pulses, np.random.default_rng(2))
Path(sys.argv[3]).write_bytes(pickle.dumps(pack(model)))
print(json.dumps(sorted({name.partition(".")[0] for name in set(sys.modules) - imported})))
"""
PREDICT = """
import json, pickle, sys
from pathlib import Path
import numpy as np
sys.path.insert(0, sys.argv[1])
from support.records.pulse_tables import pulse_table
from pyroshock.training.models.serialization import unpack
pulses = pulse_table(np.random.default_rng(1), repetitions=2)
imported = set(sys.modules)
unpack(*pickle.loads(Path(sys.argv[3]).read_bytes())).predict(pulses.inputs)
print(json.dumps(sorted({name.partition(".")[0] for name in set(sys.modules) - imported})))
"""
LIBRARIES = {
    "sklearn": "scikit-learn",
    "torch": "torch",
    "gpytorch": "gpytorch",
    "optuna": "optuna",
    "skops": "skops",
}


def imported_by(script: str, *words: str) -> set[str]:
    tests = str(Path(__file__).resolve().parents[1])
    command = [sys.executable, "-W", "ignore", "-c", script, tests, *words]
    done = subprocess.run(command, capture_output=True, text=True, env=os.environ, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    return {
        library
        for name, library in LIBRARIES.items()
        if f'"{name}"' in done.stdout.splitlines()[-1]
    }


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize(
    "model", ["hann", "linear", "pls", "tree", "ensemble", "svr", "svr-kernel", "kernel-ridge",
              "coregional-gp", "gp", "hybrid", "single-pass", "nn-narrow", "nn-ga"],
)  # fmt: skip
def test_kind_needs_the_libraries_that_it_imports(model, tmp_path):
    description = describe(entry_of(model).make(BuildOptions()))
    packed = str(tmp_path / "packed")
    fitted, predicted = imported_by(FIT, model, packed), imported_by(PREDICT, model, packed)
    assert set(_libraries(description, TO_FIT)) == {"numpy", "scipy", *fitted}
    assert set(_libraries(description, TO_PREDICT)) == {"numpy", "scipy", *predicted}


def test_handed_in_kernel_needs_gpytorch():
    import gpytorch
    from pyroshock.training.estimators.coregional import Coregional
    from pyroshock.training.estimators.linear import LinearPowers
    from pyroshock.training.models.calibrated import Calibrated
    from pyroshock.training.models.pair import Pair

    def names(kernel):
        model = Calibrated(Pair(Coregional(kernel), LinearPowers()))
        return {text.partition("==")[0] for text in requirements(describe(model))}

    always = {"pyroshock", "numpy", "scipy", "scikit-learn", "skops"}
    assert names("rbf") == always
    assert names(gpytorch.kernels.RBFKernel()) == always | {"gpytorch", "torch"}


def test_law_needs_the_package_and_numbers_alone():
    names = [
        text.partition("==")[0]
        for text in requirements({"kind": "analytic", "settings": {"law": "hann"}})
    ]
    assert names == ["pyroshock", "numpy", "scipy"]
    assert TO_FIT.keys() | TO_PREDICT.keys() <= KINDS.keys()
