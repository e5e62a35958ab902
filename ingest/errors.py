"""What an ingest refuses. Each message is one line: file, row, column, value, and what was expected."""

from __future__ import annotations


class IngestError(ValueError):
    """The campaign cannot be ingested, and nothing of it was stored."""
