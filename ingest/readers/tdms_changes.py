"""Properties of a TDMS channel that change from segment to segment: npTDMS hands on the last value
for all samples."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from typing import Any

import nptdms.tdms
from nptdms.reader import TdmsReader
from nptdms.tdms_segment import TdmsSegment
from nptdms.timestamp import TdmsTimestamp

#: A change of these is a start of its own: a gap, or none.
_STARTS = ("wf_start_time", "wf_start_offset")


@dataclass(frozen=True)
class Change:
    """A property that has another value from a sample on."""

    part: str
    name: str
    samples: int
    earlier: Any
    later: Any


class PropertyHistory(TdmsReader):  # type: ignore[misc]  # npTDMS has no types
    """npTDMS's reader, which also notes what changes. `starts` of a path: [samples before,
    property, value]."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._samples_before: dict[str, int] = defaultdict(int)
        self._values: dict[tuple[str, str], Any] = {}
        self.starts: dict[str, list[tuple[int, str, Any]]] = defaultdict(list)
        self.changes: list[Change] = []

    @staticmethod
    def install() -> None:
        """From now on every `TdmsFile` reads by it: its argument is a file, and no reader."""
        nptdms.tdms.TdmsReader = PropertyHistory

    def _update_object_metadata(self, segment: TdmsSegment) -> None:
        for part in segment.ordered_objects:
            before = self.object_metadata.get(part.path)
            self._samples_before[part.path] = before.num_values if before is not None else 0
        super()._update_object_metadata(segment)

    def _update_object_properties(self, segment_object_properties: Any) -> None:
        super()._update_object_properties(segment_object_properties)
        for part, properties in (segment_object_properties or {}).items():
            for name, value in properties:
                self._note(
                    part, name, value.as_datetime64() if isinstance(value, TdmsTimestamp) else value
                )

    def _note(self, part: str, name: str, value: Any) -> None:
        samples = self._samples_before[part]
        earlier = self._values.setdefault((part, name), value)
        if name in _STARTS:
            self.starts[part].append((samples, name, value))
        elif samples and earlier != value:
            self.changes.append(Change(part, name, samples, earlier, value))
