"""Mistakes of labels and units, told before a diagnosis: no physics may be made to explain them."""

from __future__ import annotations

from .finding import Finding, ImplausibleRecordError
from .verdict import check, implausible

__all__ = ["Finding", "ImplausibleRecordError", "check", "implausible"]
