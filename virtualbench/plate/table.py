"""The modal table that a laboratory would hand over with its plate: `plate_modes.csv` of a campaign folder."""

from __future__ import annotations

import csv
import io

from .modes import PlateModes

__all__ = ["modal_table"]


def modal_table(modes: PlateModes, point: int) -> str:
    """CSV text: mode, frequency_hz, damping_ratio, shape_impact and shape_SENSOR in 1/sqrt(kg), a row for each mode.

    For a plate that the bench then treats otherwise, give the modes without effects: the table is what the laboratory
    believes. Raises `ValueError` for an impact point the modes do not have.
    """
    if point not in range(modes.shape_impact.shape[0]):
        raise ValueError(f"point = {point!r}: expected 0 to {modes.shape_impact.shape[0] - 1}")
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    shapes = [f"shape_{name}" for name in modes.sensor_names]
    writer.writerow(["mode", "frequency_hz", "damping_ratio", "shape_impact", *shapes])
    columns = [modes.frequencies_hz, modes.damping, modes.shape_impact[point], *modes.shapes]
    rows = zip(*(column.tolist() for column in columns), strict=True)
    writer.writerows([number, *row] for number, row in enumerate(rows, start=1))
    return text.getvalue()
