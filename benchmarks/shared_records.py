"""Made pulses, twins and servers that the tests have too.

By their own path: a package of the environment is called `tests`, and would be the one that is imported.
"""

from __future__ import annotations

import sys

from .measuring import ROOT

if str(ROOT / "tests") not in sys.path:
    sys.path.append(str(ROOT / "tests"))

from support.records.pulse_tables import PREDICTORS, held_out, pulse_table
from support.records.twin_parts import BENCH, ringing_plate, setting
from support.stores.postgres_server import running_server

__all__ = ["BENCH", "PREDICTORS", "held_out", "pulse_table", "ringing_plate", "running_server", "setting"]
