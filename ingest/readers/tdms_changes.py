"""Properties of a TDMS channel that change from segment to segment: npTDMS hands on the last value for all samples."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import Any, BinaryIO

from nptdms.reader import TdmsReader
from nptdms.tdms_segment import TdmsSegment
from nptdms.timestamp import TdmsTimestamp

from .base import RecordingError
from .field_rules import FieldRule, Treatment

#: A change of these is a start of its own: a gap, or none.
_STARTS = ("wf_start_time", "wf_start_offset")


class PropertyHistory(TdmsReader):  # type: ignore[misc]  # npTDMS has no types
    """Reads the metadata of all segments once more. `starts` of a channel's path: [samples before, property, value]."""

    def __init__(self, path: Path, stream: BinaryIO, rules: Sequence[FieldRule]) -> None:
        super().__init__(stream)
        self._path_of_file = path
        self._rules = [rule for rule in rules if rule.treatment is Treatment.USED]
        self._samples_before: dict[str, int] = defaultdict(int)
        self._values: dict[tuple[str, str], Any] = {}
        self.starts: dict[str, list[tuple[int, str, Any]]] = defaultdict(list)
        self.read_metadata()

    def _update_object_metadata(self, segment: TdmsSegment) -> None:
        for part in segment.ordered_objects:
            before = self.object_metadata.get(part.path)
            self._samples_before[part.path] = before.num_values if before is not None else 0
        super()._update_object_metadata(segment)

    def _update_object_properties(self, segment_object_properties: Any) -> None:
        super()._update_object_properties(segment_object_properties)
        for part, properties in (segment_object_properties or {}).items():
            for name, value in properties:
                self._note(part, name, value.as_datetime64() if isinstance(value, TdmsTimestamp) else value)

    def _note(self, part: str, name: str, value: Any) -> None:
        before = self._samples_before[part]
        earlier = self._values.setdefault((part, name), value)
        if name in _STARTS:
            self.starts[part].append((before, name, value))
        elif before and earlier != value and any(rule.matches(name) for rule in self._rules):
            raise RecordingError(
                f"{self._path_of_file.name}: {part} has {name} = {earlier!r} up to sample {before} and {value!r} from "
                "there on; save the two parts as files of their own"
            )
