"""Records, stores and parts of a twin that the tests have too.

By their own path: a package of the environment may be called `tests`, and would be imported in
their place.
"""
# isort: skip_file
# fmt: off

from __future__ import annotations

import sys

from .harness import ROOT

if str(ROOT / "tests") not in sys.path:
    sys.path.append(str(ROOT / "tests"))

from support.checks.printed_filters import absolute_acceleration
from support.records.contact_bodies import ball, impacts
from support.records.force_records import ForceRecord, force_records
from support.records.gun_campaigns import gun_record
from support.records.hammer_recordings import FULL_SCALE_N, HITS, NOISE_STEPS, digitised
from support.records.hammer_recordings import hammer_record, hit_force, kept_campaign
from support.records.hammer_recordings import write_campaign
from support.records.labelled_records import Labelled, Signal, made_records
from support.records.pulse_tables import PREDICTORS, held_out, pulse_table
from support.records.scalar_gun import THESIS_GUN, Method, ScalarGun, scalar_guns
from support.records.twin_parts import BENCH, ringing_plate, setting
from support.stores.databases import fresh_database, make_tables
from support.stores.hammer_stores import full_campaign
from support.stores.large_store import HITS_PER_RECORDING, RARE, WRITER, StoreSize
from support.stores.large_store import campaign_name, fill, filled, sample_of
from support.stores.postgres_server import running_server

__all__ = [
    "BENCH", "FULL_SCALE_N", "HITS", "HITS_PER_RECORDING", "NOISE_STEPS", "PREDICTORS", "RARE",
    "THESIS_GUN", "WRITER", "ForceRecord", "Labelled", "Method", "ScalarGun", "Signal", "StoreSize",
    "absolute_acceleration", "ball", "campaign_name", "digitised", "fill", "filled",
    "force_records", "fresh_database", "full_campaign", "gun_record",
    "hammer_record", "held_out", "hit_force", "impacts", "kept_campaign", "made_records",
    "make_tables", "pulse_table", "ringing_plate",
    "running_server", "sample_of", "scalar_guns", "setting", "write_campaign",
]
