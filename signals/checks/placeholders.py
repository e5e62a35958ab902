"""Placeholders: samples that the instrument or an export wrote where it had no reading."""

from __future__ import annotations

import numpy as np

from ..channel import Channel
from .base import Contact, Finding
from .levels import SampleRuns, runs_of

#: Samples that the evidence lists; all are counted.
LISTED = 16


def check_placeholders(channel: Channel, contacts: tuple[Contact, ...]) -> list[Finding]:
    """A `reject` for each contact that holds lone samples far outside of their neighbourhood
    (9.99e37, -9999, -32768), and one for those outside of all contacts. Any quantity but voltage
    and displacement, where only numbers beyond every range count.

    Figures, spectra and contacts are taken from the record with these samples mended; the raw
    series keeps them.
    """
    lone = channel.placeholders.lone
    if not lone.size:
        return []
    return [
        _finding(channel, contact, runs) for contact, runs in runs_of(lone).by_contact(contacts)
    ]


def _finding(channel: Channel, contact: int | None, runs: SampleRuns) -> Finding:
    at = np.concatenate([np.arange(a, b + 1) for a, b in zip(runs.first, runs.last, strict=True)])
    first, unit = int(at[0]), channel.si_unit
    evidence = {
        **runs.evidence(channel),
        "samples_at": at[:LISTED].tolist(),
        "recorded": channel.recorded[at[:LISTED]].tolist(),
        "mended": channel.readings[at[:LISTED]].tolist(),
        "unit": unit,
    }
    more = f" (and {at.size - 1} more)" if at.size > 1 else ""
    message = (
        f"sample {first} at {evidence['first_time_s']:.6g} s{more} is no reading: "
        f"{float(channel.recorded[first]):.7g} in the file, {float(channel.si[first]):.4g} {unit} "
        f"where its neighbours give {float(channel.readings[first]):.4g} {unit}; export the record "
        "again without placeholders, or mend the sample"
    )
    return Finding("placeholder", "reject", message, channel.name, evidence, contact)
