"""How pulses are cut out of a record: data, stored with every pulse, so that a re-extraction is a
new version."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass, fields
from typing import Any, Literal, get_args

#: Raised whenever a change of the code changes a number that the same settings give.
EXTRACTION_VERSION = 2

Segmentation = Literal["walk", "mask"]


@dataclass(frozen=True)
class ExtractionSettings:
    """Settings of the extraction (thesis, section 4.1). Raises `ValueError` naming the setting and
    its bounds."""

    #: "walk": outward from each peak (the thesis's choice). "mask": where the whole record is above
    #: the threshold.
    segmentation: Segmentation = "walk"
    #: Contact ends where the force falls to this share of the peak.
    threshold: float = 0.005
    #: Points of the fine pulse per recorded sample.
    refinement: int = 10
    #: csaps smoothing parameter p on the sample index: 1 interpolates. At 0.99 a nine-sample
    #: half-sine loses
    #: 0.015 % of its peak, and noise at the sampling limit is halved.
    smoothing: float = 0.99
    #: Equidistant points of the force for the models.
    points: int = 20
    #: An event is a peak of at least this share of the record's largest.
    event_share: float = 0.1
    #: ... and of at least this many standard deviations of the noise.
    event_noise: float = 10.0
    #: Contacts nearer than this belong to one impact: a second hit of the same swing, not a further
    #: repetition.
    separation_s: float = 0.1
    #: The threshold never lies below this many standard deviations of the noise, where a walk would
    #: not end.
    threshold_noise: float = 2.0
    #: Remove the hammer's own dynamics from its acceleration (eq. 4.2) where a recording holds at
    #: least this many hits to estimate them from; 0 never does. With one hit, a / (a / F) would
    #: return the force by construction.
    deconvolve_from_hits: int = 3
    #: Where the hammer moves as one body, between the hand's resonance and the head's: there its
    #: response is 1.
    rigid_from_hz: float = 100.0
    rigid_to_hz: float = 1000.0

    def __post_init__(self) -> None:
        if self.segmentation not in get_args(Segmentation):
            raise ValueError(
                f"segmentation is {self.segmentation!r}; known: {', '.join(get_args(Segmentation))}"
            )
        for name, low, high in (
            ("threshold", 1e-6, 0.5),
            ("refinement", 1, 1000),
            ("smoothing", 1e-6, 1.0),
            ("points", 4, 10_000),
            ("event_share", 1e-6, 1.0),
            ("event_noise", 0.0, 1e6),
            ("separation_s", 0.0, 1e6),
            ("threshold_noise", 0.0, 1e6),
            ("deconvolve_from_hits", 0, 10**9),
            ("rigid_from_hz", 0.0, self.rigid_to_hz),
            ("rigid_to_hz", self.rigid_from_hz, 1e9),
        ):
            value = getattr(self, name)
            if not low <= value <= high:
                raise ValueError(f"{name} is {value!r}; expected {low:g} to {high:g}")

    def as_json(self) -> dict[str, Any]:
        return asdict(self)

    @property
    def fingerprint(self) -> str:
        """SHA-256 of the settings and the code's version."""
        text = json.dumps([EXTRACTION_VERSION, self.as_json()], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()

    @classmethod
    def names(cls) -> tuple[str, ...]:
        return tuple(f.name for f in fields(cls))
