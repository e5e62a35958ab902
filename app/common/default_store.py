"""Where the store is when nobody says so: in the folder that a person works in."""

from __future__ import annotations

DEFAULT_DB = "sqlite:///pyroshock.db"
