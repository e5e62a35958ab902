"""The contact force of a shot from the accelerations of the plate it strikes (thesis, section
2.2.1, eq. 2.7 to 2.9).

Hammer hits at the point that the projectile strikes give the transfer functions H = a / F of the
accelerometers (eq.
2.7). A shot's accelerations over H (eq. 2.8) are its force: eq. 2.9, minus the plate's mass times
the corrected acceleration, holds for an H that was normalised to 1, which this one is not. Several
accelerometers are taken together by least squares, so that one sees what another does not.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...array_types import Floats
from ...signals.channel import Channel, Sensor
from ...signals.checks.base import Finding, Severity
from ..errors import IngestError
from ..folder.campaign_tables import CampaignTables
from ..folder.recording_options import ADVICE, FILE, ForceSource
from ..readers import AS_IN_FILE, ReadingOptions, RecordingError, open_recording
from .common_grid import GridError, on_one_grid
from .deconvolution import DEFAULT_REGULARISATION, deconvolve_together
from .pulses import find_hits
from .settings import ExtractionSettings
from .transfer_function import TransferFunction, TransferFunctionError, estimate_transfer_function

#: The derived channel's name.
NAME = "force_derived"
#: Fewer hits give no coherence that says anything.
MIN_HITS = 3
#: H is known as far as its coherence, over a sixth of an octave, stays above this.
MIN_COHERENCE = 0.9
#: Rest before a contact, and the weight at the end of a hit's window (as in the thesis's database
#: of hits).
_BEFORE_S, _END_WEIGHT = 6e-3, 1e-3
#: A pulse that lasts T at a tenth of its peak needs H up to so many over T. The filter at that end
#: makes a shorter pulse as long as about 1.2 over it, so a length of 1.8 over it or more is the
#: pulse's own.
BAND_OF_PULSE = 1.8
#: The part of a window that is kept: later, the exponential weight has made noise of what is left.
_KEPT_SHARE = 0.25
#: Force outside of the contact, rms over peak: up to the first a `note`, up to the second a
#: `warning`.
_RESIDUALS = (0.02, 0.1)


@dataclass(frozen=True)
class TransferFunctions:
    """Transfer functions of the accelerometers of `source`, known up to `to_hz`; `sha256` of the
    hammer's recording."""

    source: ForceSource
    functions: tuple[TransferFunction, ...]
    to_hz: float
    hits: int
    sha256: str

    @property
    def sampling_rate_hz(self) -> float:
        return self.functions[0].sampling_rate_hz


def campaign_plate_response(tables: CampaignTables) -> TransferFunctions | None:
    """The plate's transfer functions, where `[force]` asks for them; else None.

    Parameters:
        tables: The tables of the campaign folder.

    Raises:
        IngestError: For a row that was struck elsewhere than the hammer's hits: its transfer
            function is another one. Also as `plate_response`.
    """
    file = tables.file
    if file.force is None:
        return None
    hammer = file.force.impact_position
    for row in tables.rows:
        struck = row.levels_by_factor.get("impact_position")
        place = None if struck is None else struck.label
        if place is not None and place != hammer:
            raise IngestError(
                f"{row.place}: impact_position is {place!r}, force.impact_position of "
                f"campaign.toml {hammer!r}: a transfer function holds for one place; hit the plate "
                "with the hammer where the projectile strikes it, or put these rows into a "
                "campaign of their own"
            )
    return plate_response(file.folder, file.force, dict(file.sensors), file.reading)


def plate_response(
    folder: Path,
    source: ForceSource,
    sensors: dict[str, Sensor],
    reading: ReadingOptions = AS_IN_FILE,
) -> TransferFunctions:
    """H of each accelerometer from the hammer's recording.

    Parameters:
        folder: The campaign folder.
        source: The accelerometers and the recording that `[force]` names.
        sensors: The declared sensors by channel, those of the accelerometers among them.
        reading: What a laboratory says of its files where these do not; by default nothing.

    Raises:
        IngestError: Where the recording gives no H; the message says how to get it.

    Source:
        Thesis, eq. 2.7.
    """
    file = folder / source.recording
    wanted = {name: sensors[name] for name in source.accelerometers} | {
        source.hammer.name: source.hammer
    }
    try:
        with open_recording(file, reading) as recording:
            channels = {
                name: Channel(
                    sensor,
                    recording.read(name),
                    (info := recording.info(name)).sampling_rate_hz,
                    info.start_s,
                )
                for name, sensor in wanted.items()
            }
        digest = hashlib.sha256(file.read_bytes()).hexdigest()
        grid = on_one_grid(
            [channels[name] for name in (source.hammer.name, *source.accelerometers)]
        )
    except (RecordingError, GridError, OSError) as error:
        raise IngestError(f"{FILE}: force.transfer_function: {error}; {ADVICE}") from error
    force, *accelerations = grid.values
    rate = grid.sampling_rate_hz
    hits = find_hits(force, rate).pulses
    if len(hits) < MIN_HITS:
        raise IngestError(
            f"{FILE}: force.transfer_function: {source.recording} holds "
            f"{len(hits)} hits, {MIN_HITS} needed; {ADVICE}"
        )
    upright = force * hits[0].sign - hits[0].rest_n
    starts = np.array(
        [max(0, pulse.contact.first - round(_BEFORE_S * rate)) for pulse in hits], dtype=np.int64
    )
    segment = int(np.diff(starts, append=force.size).min()) // 2 * 2
    try:
        functions = tuple(
            estimate_transfer_function(
                acceleration, upright, rate, starts=starts, segment=segment, end_weight=_END_WEIGHT
            )
            for acceleration in accelerations
        )
    except TransferFunctionError as error:
        raise IngestError(
            f"{FILE}: force.transfer_function: {source.recording}: {error}; {ADVICE}"
        ) from error
    return TransferFunctions(source, functions, _known_to(functions), len(hits), digest)


def derived_force(
    channels: Sequence[Channel], plate: TransferFunctions, settings: ExtractionSettings
) -> tuple[Channel | None, Finding]:
    """The force of one shot as a channel of its own, which begins shortly before the contact, and
    what is to be said of it.

    Parameters:
        channels: The channels of the shot's recording.
        plate: The transfer functions of the plate that was struck.
        settings: How the pulse is cut out of the derived force.

    Returns:
        The channel and a finding. The channel is None, and the finding a `reject`, where H does not
        reach as high as the pulse, or has another sampling rate, and where no contact rises above
        the noise.
    """
    by_name = {channel.name: channel for channel in channels}
    used = [by_name[name] for name in plate.source.accelerometers]
    first, rate = used[0], used[0].sampling_rate_hz
    try:
        grid = on_one_grid(used)
        if not np.isclose(rate, plate.sampling_rate_hz):
            raise GridError(
                f"the shot was recorded at {rate:g} Hz, the hammer's hits at "
                f"{plate.sampling_rate_hz:g} Hz; record both at one rate"
            )
    except GridError as error:
        return None, Finding("derived-force", "reject", f"no force derived: {error}", first.name)
    begin = _begin(grid.values, rate)
    segment = plate.functions[0].segment
    rest = round(_BEFORE_S * rate) // 2
    window = np.stack(
        [_rested(samples, begin, rest)[begin : begin + segment] for samples in grid.values]
    )
    force = deconvolve_together(window, plate.functions, rate, plate.to_hz, DEFAULT_REGULARISATION)
    force = force[: max(2, round(_KEPT_SHARE * segment))]
    hits = find_hits(force, rate, settings, expected=1).pulses
    if not hits:
        message = (
            "no force derived: no contact rises above the noise of what the accelerations give"
        )
        return None, Finding("derived-force", "reject", message, first.name)
    pulse = hits[0]
    if plate.to_hz * pulse.width_tenth_s < BAND_OF_PULSE:
        message = (
            f"no force derived: the pulse lasts {pulse.width_tenth_s * 1e3:.3g} ms or less and "
            f"needs the plate's transfer function up to {BAND_OF_PULSE / pulse.width_tenth_s:.4g} "
            f"Hz, which the hammer's hits give up to {plate.to_hz:.4g} Hz; hit with a harder tip"
        )
        evidence = {"known_to_hz": plate.to_hz, "pulse_s": pulse.width_tenth_s}
        return None, Finding("derived-force", "reject", message, first.name, evidence)
    outside = np.r_[force[: pulse.contact.first], force[pulse.contact.last + 1 :]] - np.median(
        force
    )
    residual = float(np.sqrt(np.mean(outside**2))) / pulse.peak_force_n if outside.size else 0.0
    header = {
        "derived_from": list(plate.source.accelerometers),
        "method": "accelerations over the plate's transfer function (thesis, eq. 2.7 to 2.9)",
        "transfer_function": plate.source.recording,
        "transfer_function_sha256": plate.sha256,
        "known_to_hz": plate.to_hz,
    }
    sensor = Sensor(NAME, "force", "N", position=plate.source.impact_position)
    channel = Channel(sensor, force.astype(np.float32), rate, grid.start_s + begin / rate, header)
    return channel, _residual_finding(plate, residual)


def _residual_finding(plate: TransferFunctions, residual: float) -> Finding:
    severity: Severity = (
        "note"
        if residual <= _RESIDUALS[0]
        else "warning"
        if residual <= _RESIDUALS[1]
        else "reject"
    )
    place = (
        ""
        if plate.source.impact_position
        else "; that both struck one place is assumed, for nobody states where"
    )
    message = (
        f"the force is derived from {', '.join(plate.source.accelerometers)} by {plate.hits} "
        f"hammer hits, up to {plate.to_hz:.4g} Hz; outside of the contact, where it should be 0, "
        f"its rms is {residual:.2%} of the peak{place}"
    )
    evidence = {"residual": residual, "known_to_hz": plate.to_hz, "hits": plate.hits}
    return Finding("derived-force", severity, message, NAME, evidence)


def _known_to(functions: Sequence[TransferFunction]) -> float:
    """Up to where the best of the accelerometers keeps its coherence, Hz."""
    coherence = np.max([tf.coherence for tf in functions], axis=0)
    frequency = functions[0].frequency_hz
    low = 1
    while low < frequency.size:
        high = max(low + 1, int(low * 2 ** (1 / 6)))
        if float(np.median(coherence[low:high])) < MIN_COHERENCE and frequency[low] > 50.0:
            break
        low = high
    return float(frequency[min(low, frequency.size - 1)])


def _begin(accelerations: Floats, rate_hz: float) -> int:
    """The sample that a shot's window begins with: some rest before the accelerations (k, n) leave
    it."""
    away = np.max([np.abs(x - np.median(x[:64])) for x in accelerations], axis=0)
    onset = int(np.argmax(away > 0.02 * away.max()))
    return max(0, onset - round(_BEFORE_S * rate_hz))


def _rested(x: Floats, begin: int, samples: int) -> Floats:
    return x - float(np.mean(x[begin : begin + max(1, samples)]))
