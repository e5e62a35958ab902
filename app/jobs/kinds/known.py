"""Every kind of job; a new one is a file here and a word below."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from .base import Kind
from .diagnose import DIAGNOSE
from .extract import EXTRACT
from .ingest import INGEST
from .plan import PLAN
from .train import TRAIN
from .tune import TUNE
from .validate import VALIDATE

_ALL: tuple[Kind[Any], ...] = (INGEST, EXTRACT, PLAN, TRAIN, TUNE, DIAGNOSE, VALIDATE)
KINDS: Mapping[str, Kind[Any]] = {kind.name: kind for kind in _ALL}
