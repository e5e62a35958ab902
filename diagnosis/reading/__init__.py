"""Campaigns as a diagnosis takes them: from a store, or straight from a folder."""

from __future__ import annotations

from .campaign import read_campaign, read_folder

__all__ = ["read_campaign", "read_folder"]
