"""What the velocity of an impact means, by how it was obtained."""

from __future__ import annotations

#: Measured by a laser, reported by the lab, or predicted: the velocity with which the impactor
#: meets the target.
BEFORE_CONTACT = "before contact"
INTEGRATED = "integrated to the peak"
#: The same with the velocity that the target's surface had at the peak: an estimate of the velocity
#: before contact.
TARGET_MOTION_ADDED = "integrated, target's motion added"
KINDS = (BEFORE_CONTACT, INTEGRATED, TARGET_MOTION_ADDED)

#: `velocity_source` of an impact or a shot -> kind. What a laboratory reports is taken to be before
#: contact.
KIND_OF_SOURCE = {
    "reported": BEFORE_CONTACT,
    "laser": BEFORE_CONTACT,
    "integrated": INTEGRATED,
    "integrated with target motion": TARGET_MOTION_ADDED,
}


def velocity_kind(source: str | None) -> str | None:
    """The kind of a stored velocity; None where there is no velocity. Raises `LookupError` for an
    unknown source."""
    if source is None:
        return None
    if source not in KIND_OF_SOURCE:
        raise LookupError(f"velocity_source is {source!r}; known: {', '.join(KIND_OF_SOURCE)}")
    return KIND_OF_SOURCE[source]
