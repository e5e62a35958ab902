"""The noun `impacts`: what the store holds of them, and what is made of it."""

from __future__ import annotations

from ..command_line.operation_group import OperationGroup

impacts = OperationGroup(
    "impacts",
    """List impacts with their factors and figures; show one, delete its recording, try another
    extraction of its pulse, or compare spectra. Without a command, list them.

    \b
    Example:
        pyroshock impacts --campaign rehearsal --where tip_material=steel \\
            --where "peak_force_n>1000"
        pyroshock impacts --sort -peak_force_n --columns id,tip_material,peak_force_n --csv
    """,
)
