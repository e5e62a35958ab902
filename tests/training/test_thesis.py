"""The thesis's figures, cell by cell against its tables typed elsewhere."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest
from pyroshock.app.operations.train.tables import all_figures, thesis_figures
from pyroshock.training.evaluation.metrics import METRICS

TIMES = {
    "decision tree (min leaf 36)": "tree",
    "Gaussian process regression": "gp",
    "ensemble": "ensemble",
    "SVM": "svr",
    "kernel": "kernel-ridge",
    "linear regression": "linear",
}
FORCES = {
    "Gaussian process": "gp",
    "trilayered NN": "nn-trilayer",
    "wide NN": "nn-wide",
    "coregional GPR": "coregional-gp",
    "medium NN": "nn-medium",
    "narrow NN": "nn-narrow",
    "bilayered NN": "nn-bilayer",
    "support vector": "svr",
    "kernel": "kernel-ridge",
    "multivariate linear": "linear",
    "support vector kernel": "svr-kernel",
    "partial least square": "pls",
}
PULSES = {
    "GPyTorch Gaussian process": "coregional-gp",
    "neural network": "nn-ga",
    "Hann window": "hann",
    "Hunter": "hunter",
    "Reed": "reed",
}
OPTIMISED = {
    "GPyTorch GP, contact time": {"coregional-gp"},
    "GPyTorch coregional GP, force": {"coregional-gp"},
    "MATLAB GP, contact time": {"nn-ga", "gp"},
    "MATLAB NN, force": {"nn-ga"},
}


@pytest.mark.parametrize(
    ("file", "table", "models", "columns"),
    [
        (
            "table_4_4_contact_time_models",
            "4.4",
            TIMES,
            {"mean_absolute_relative_error": "contact_time_error"},
        ),
        (
            "table_4_5_force_models",
            "4.5",
            FORCES,
            {"mean_rmse_n": "force_rmse_n", "mean_nrmse": "force_nrmse"},
        ),
        (
            "table_5_2_pulse_cost",
            "5.2",
            PULSES,
            {
                "mean_cost": "cost",
                "force_rmse_n": "force_rmse_n",
                "time_error": "contact_time_error",
            },
        ),
        (
            "table_5_3_physical_parameters",
            "5.3",
            PULSES,
            {
                "peak_force_error": "peak_force_error",
                "elastic_time_error": "compression_time_error",
                "impulse_error": "impulse_error",
                "elastic_impulse_error": "compression_impulse_error",
            },
        ),
    ],
)
def test_tables_agree(
    thesis_tables: Path, file: str, table: str, models: dict[str, str], columns: dict[str, str]
) -> None:
    with (thesis_tables / f"{file}.csv").open(newline="") as handle:
        rows = list(csv.DictReader(handle))
    expected = {(models[row["model"]], columns[c], float(row[c])) for row in rows for c in columns}
    assert {(f.model, f.metric, f.value) for f in all_figures() if f.table == table} == expected


def test_optimised_models_agree(thesis_tables: Path) -> None:
    names = {
        "rmse_n": "force_rmse_n",
        "nrmse": "force_nrmse",
        "mean absolute relative error": "contact_time_error",
    }
    with (thesis_tables / "table_4_6_to_4_9_optimised_models.csv").open(newline="") as handle:
        expected = {
            (model, names[row["metric"]], float(row["value"]), row["table"])
            for row in csv.DictReader(handle)
            for model in OPTIMISED[row["model"]]
        }
    ours = {(f.model, f.metric, f.value, f.table) for f in all_figures()}
    assert {row for row in ours if row[3] in {"4.6", "4.7", "4.8", "4.9"}} == expected
    figures = thesis_figures("coregional-gp")
    assert set(figures) == set(METRICS)
    assert (figures["force_rmse_n"].value, figures["force_rmse_n"].table) == (35.851, "4.7")
    assert thesis_figures("gp")["contact_time_error"].table == "4.4"
    assert thesis_figures("hybrid") == {}
