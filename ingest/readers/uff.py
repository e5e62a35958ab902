"""Universal file format, data set 58 ("function at nodal DOF"), ASCII and binary."""

from __future__ import annotations

import re
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .base import ReadingOptions, RecordingError, rate_from_step, refuse_bomb
from .contents import Array, Contents, lazy_array
from .recording import ArrayReader

if TYPE_CHECKING:
    import pyuff

_Pair = tuple[NDArray[np.float64], NDArray[Any]]
_TAG = b"    -1"
#: A tag ends its line, or is followed by blanks up to column 80.
_TAGS = re.compile(rb"    -1(?=[\r\n]|\Z| {74})")
#: Function types "general" and "time response"; the others (spectra, transfer functions) are no recordings.
_TIME_FUNCTIONS = (0, 1)
_DTYPES = {2: "f4", 4: "f8", 5: "c8", 6: "c16"}
#: Record 7 prints the increment with six digits (E13.5), of which the last may be off by half a unit.
_PRINTED_STEP = 5.1e-6
_HEADER_KEYS = ("id1", "id2", "id3", "id4", "id5", "rsp_ent_name", "rsp_node", "rsp_dir", "abscissa_inc")


class UffReader(ArrayReader):
    """A channel is called by ID line 1 where these differ, else by entity, node and direction of the response."""

    format = "uff"
    suffixes = (".uff", ".unv", ".uf")

    def contents(self, path: Path, _: ExitStack, __: ReadingOptions) -> Contents:
        import pyuff

        _refuse_unclosed(path)
        file = pyuff.UFF(str(path))
        sets = [n for n, kind in enumerate(file.get_set_types()) if kind == 58]
        heads = {n: file.read_sets(n, header_only=True) for n in sets}
        times = {n: head for n, head in heads.items() if head["func_type"] in _TIME_FUNCTIONS}
        names = dict(zip(times, _names(list(times.values())), strict=True))
        return Contents([_array(path, file, n, names[n], head) for n, head in times.items()])


def _refuse_unclosed(path: Path) -> None:
    """Every data set lies between two tags `-1`; pyuff passes over one that lacks its second."""
    raw = path.read_bytes()
    if not raw.startswith(_TAG) or not raw.rstrip(b" \r\n").endswith(_TAG) or len(_TAGS.findall(raw)) % 2:
        raise RecordingError(f"{path.name}: its tags '    -1' do not enclose whole data sets; it is cut, or not UFF")


def _names(heads: list[dict[str, Any]]) -> list[str]:
    """ID line 1 of each set where all are given and differ; else entity, node and direction of the response."""
    by_id = [head["id1"] for head in heads]
    if all(name not in ("", "NONE") for name in by_id) and len(set(by_id)) == len(by_id):
        return by_id
    return [f"{head['rsp_ent_name'] or 'NONE'}:{head['rsp_node']}:{head['rsp_dir']:+d}" for head in heads]


def _array(path: Path, file: pyuff.UFF, number: int, name: str, head: dict[str, Any]) -> Array:
    samples, dtype = int(head["num_pts"]), np.dtype(_DTYPES.get(head["ord_data_type"], "O"))
    if samples < 0:
        raise RecordingError(f"{path.name}: {name!r} declares {samples} samples; expected none or more")
    refuse_bomb(path, name, samples, dtype.itemsize)
    load = partial(_load, path, file, number, name, samples)
    clock: dict[str, Any] = {"times_s": load()[0]} if head["abscissa_spacing"] == 0 else _even_clock(path, head, name)

    def values() -> NDArray[Any]:
        return load()[1].astype(dtype)

    return Array(
        name,
        (samples,),
        dtype,
        lazy_array(values),
        unit={"NONE": None}.get(label := head.get("ordinate_axis_units_lab", ""), label),
        header={key: head[key] for key in _HEADER_KEYS if key in head},
        **clock,
    )


def _even_clock(path: Path, head: dict[str, Any], name: str) -> dict[str, Any]:
    """From the abscissa's minimum and increment."""
    step = float(head["abscissa_inc"])
    if not (np.isfinite(step) and step > 0.0):
        raise RecordingError(f"{path.name}: {name!r} has an abscissa increment of {step} s; expected a step above 0")
    return {"rate_hz": rate_from_step(step, _PRINTED_STEP), "start_s": float(head["abscissa_min"])}


def _load(path: Path, file: pyuff.UFF, number: int, name: str, samples: int) -> _Pair:
    """(times, values) of one set, as many as it declares."""
    data_set = file.read_sets(number)
    if len(data_set["data"]) != samples:
        raise RecordingError(
            f"{path.name}: {name!r} declares {samples} samples and holds {len(data_set['data'])}; it is cut or damaged"
        )
    return data_set["x"], data_set["data"]
