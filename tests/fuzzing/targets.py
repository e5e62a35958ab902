"""All targets. A new reader, table or way in is a line in one of the three lists."""

from __future__ import annotations

from fuzzing.campaigns_in import WHOLE
from fuzzing.readers import READERS
from fuzzing.tables_in import TABLES
from fuzzing.target import Target

TARGETS: dict[str, Target] = {target.name: target for target in (*READERS, *TABLES, *WHOLE)}
