"""What an impact velocity means, by how it was obtained: the kinds of a velocity, and the kind of each source.

A velocity that was integrated from the impactor's deceleration to the peak of the force (thesis, section 4.1) is
the one that the impactor lost until then. Where the target gives way, the impactor still moves with the target's
surface at the peak, and the integral is only 0.3 to 0.8 of the velocity before contact.
"""

from __future__ import annotations

#: Measured by a laser, reported by the lab, or predicted: the velocity with which the impactor meets the target.
BEFORE_CONTACT = "before contact"
INTEGRATED = "integrated to the peak"
#: The same with the velocity that the target's surface had at the peak: an estimate of the velocity before contact.
TARGET_MOTION_ADDED = "integrated, target's motion added"
KINDS = (BEFORE_CONTACT, INTEGRATED, TARGET_MOTION_ADDED)

#: `velocity_source` of an impact or a shot -> kind. What a laboratory reports is taken to be before contact.
KIND_OF_SOURCE = {
    "reported": BEFORE_CONTACT,
    "laser": BEFORE_CONTACT,
    "integrated": INTEGRATED,
    "integrated with target motion": TARGET_MOTION_ADDED,
}


def velocity_kind(source: str | None) -> str | None:
    """The kind of a stored velocity; None where there is no velocity. Raises `LookupError` for an unknown source."""
    if source is None:
        return None
    if source not in KIND_OF_SOURCE:
        raise LookupError(f"velocity_source is {source!r}; known: {', '.join(KIND_OF_SOURCE)}")
    return KIND_OF_SOURCE[source]
