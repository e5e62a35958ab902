"""Universal file format, data set 58 ("function at nodal DOF"), ASCII and binary."""

from __future__ import annotations

import re
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .base import ReadingOptions, RecordingError, rate_from_step, refuse_bomb
from .contents import TIME_UNITS, Array, Contents, is_time_name, lazy_array
from .file_fields import unread_field
from .recording import ArrayReader
from .uff_fields import UFF_FIELDS
from .uff_text import TAG, normalised

if TYPE_CHECKING:
    import pyuff

_Pair = tuple[NDArray[np.float64], NDArray[Any]]
#: A tag ends its line, or is followed by blanks up to column 80.
_TAGS = re.compile(rb"    -1(?=[\r\n]|\Z| {74})")
#: Function types "general" and "time response"; the others (spectra, transfer functions) are no
#: recordings.
_TIME_FUNCTIONS = (0, 1)
#: Specific data types of the abscissa (record 8): unknown, general, time. Others are frequency,
#: rpm, order and so on.
_UNKNOWN_ABSCISSAS, _TIME_ABSCISSA = (0, 1), 17
_DTYPES = {2: "f4", 4: "f8", 5: "c8", 6: "c16"}
#: Record 7 prints the increment with six digits (E13.5), of which the last may be off by half a
#: unit.
_PRINTED_STEP = 5.1e-6
_HEADER_KEYS = (
    "id1",
    "id2",
    "id3",
    "id4",
    "id5",
    "rsp_ent_name",
    "rsp_node",
    "rsp_dir",
    "abscissa_inc",
)


class UffReader(ArrayReader):
    """A channel is called by ID line 1 where these differ, else by entity, node and direction of
    the response.

    Blanks behind the numbers of a line, and tags that are not at column 6, are read as others read
    them.
    """

    format = "uff"
    suffixes = (".uff", ".unv", ".uf")
    fields = UFF_FIELDS

    def contents(self, path: Path, open_files: ExitStack, options: ReadingOptions) -> Contents:
        import pyuff

        file = pyuff.UFF(str(_standard_form(path, open_files)))
        sets = [n for n, kind in enumerate(file.get_set_types()) if kind == 58]
        heads = {n: file.read_sets(n, header_only=True) for n in sets}
        times = {n: head for n, head in heads.items() if head["func_type"] in _TIME_FUNCTIONS}
        names = dict(zip(times, _names(list(times.values())), strict=True))
        return Contents(
            [_array(path, file, n, names[n], head, options) for n, head in times.items()]
        )


def _standard_form(path: Path, open_files: ExitStack) -> Path:
    """The file, or a copy of it in the form that pyuff reads. Raises `RecordingError` for a set
    without its second tag.

    Every data set lies between two tags `-1`; pyuff passes over one that lacks its second.
    """
    raw = path.read_bytes()
    standard = normalised(raw)
    if (
        not standard.startswith(TAG)
        or not standard.rstrip(b" \r\n").endswith(TAG)
        or len(_TAGS.findall(standard)) % 2
    ):
        raise RecordingError(
            f"{path.name}: its tags '    -1' do not enclose whole data sets; it is cut, or not UFF"
        )
    if standard == raw:
        return path
    copy = Path(open_files.enter_context(TemporaryDirectory(prefix="pyroshock-"))) / "standard.uff"
    copy.write_bytes(standard)
    return copy


def _names(heads: list[dict[str, Any]]) -> list[str]:
    """ID line 1 of each set where all are given and differ; else entity, node and direction of the
    response."""
    by_id = [head["id1"] for head in heads]
    if all(name not in ("", "NONE") for name in by_id) and len(set(by_id)) == len(by_id):
        return by_id
    return [
        f"{head['rsp_ent_name'] or 'NONE'}:{head['rsp_node']}:{head['rsp_dir']:+d}"
        for head in heads
    ]


def _array(
    path: Path,
    file: pyuff.UFF,
    number: int,
    name: str,
    head: dict[str, Any],
    options: ReadingOptions,
) -> Array:
    samples, dtype = int(head["num_pts"]), np.dtype(_DTYPES.get(head["ord_data_type"], "O"))
    if samples < 0:
        raise RecordingError(
            f"{path.name}: {name!r} declares {samples} samples; expected none or more"
        )
    refuse_bomb(path, name, samples, dtype.itemsize)
    load = partial(_load, path, file, number, name, samples)
    unit_s, obstacle = _unit_of_abscissa(head)
    if obstacle is not None:
        clock: dict[str, Any] = {"obstacle": obstacle}
    elif head["abscissa_spacing"] == 0:
        clock = {"times_s": np.asarray(load()[0], dtype=np.float64) * unit_s}
    else:
        clock = _even_clock(path, head, name, unit_s)
    fields = {key: value for key, value in head.items() if key not in ("data", "x")}
    clock.setdefault("obstacle", unread_field(UFF_FIELDS, fields, options))

    def values() -> NDArray[Any]:
        return load()[1].astype(dtype)

    return Array(
        name,
        (samples,),
        dtype,
        lazy_array(values),
        unit=_label(head, "ordinate_axis_units_lab") or None,
        header={key: head[key] for key in _HEADER_KEYS if key in head},
        **clock,
    )


def _unit_of_abscissa(head: dict[str, Any]) -> tuple[float, str | None]:
    """Seconds per unit of the abscissa, and why it is no time where it is none."""
    kind = int(head.get("abscissa_spec_data_type", 0))
    label, unit = (_label(head, key) for key in ("abscissa_axis_lab", "abscissa_axis_units_lab"))
    scale = TIME_UNITS.get(unit.lower()) if unit else 1.0
    is_time = kind == _TIME_ABSCISSA or (
        kind in _UNKNOWN_ABSCISSAS and (not label or is_time_name(label) or bool(unit))
    )
    if is_time and scale is not None:
        return scale, None
    return 1.0, (
        f"has an abscissa of type {kind} (record 8), called {label!r} in {unit!r}, which is no "
        "time in s, ms, us, ns, min or h; export the time response"
    )


def _label(head: dict[str, Any], key: str) -> str:
    text = str(head.get(key) or "").strip()
    return "" if text.upper() == "NONE" else text


def _even_clock(path: Path, head: dict[str, Any], name: str, unit_s: float) -> dict[str, Any]:
    """From the abscissa's minimum and increment."""
    step = float(head["abscissa_inc"])
    if not (np.isfinite(step) and step > 0.0):
        raise RecordingError(
            f"{path.name}: {name!r} has an abscissa increment of {step} s; expected a step above 0"
        )
    return {
        "rate_hz": rate_from_step(step * unit_s, _PRINTED_STEP),
        "start_s": float(head["abscissa_min"]) * unit_s,
    }


def _load(path: Path, file: pyuff.UFF, number: int, name: str, samples: int) -> _Pair:
    """(times, values) of one set, as many as it declares."""
    data_set = file.read_sets(number)
    if len(data_set["data"]) != samples:
        raise RecordingError(
            f"{path.name}: {name!r} declares {samples} samples and holds "
            f"{len(data_set['data'])}; it is cut or damaged"
        )
    return data_set["x"], data_set["data"]
