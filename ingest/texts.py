"""Texts that a lab writes: how long a name may be, and how a message shows a value."""

from __future__ import annotations

#: Longest name of a campaign, channel, factor or level: PostgreSQL indexes no text beyond 2.7 kB.
LONGEST_NAME = 500


def shown(value: object) -> str:
    """A value for a message, shortened."""
    try:
        text = repr(value)
    except ValueError:  # Python writes no whole number of more than 4300 digits
        return "a number of thousands of digits"
    return text if len(text) <= 100 else text[:100] + "…"
