"""Oscilloscopes and recorders that write text: how a file of each is recognised, and where its
header states names, units, rate, start and length.

An instrument is one entry of `INSTRUMENTS`, by which `instrument_header` reads. The first entry
whose signs all stand above the numbers is taken.
"""

from __future__ import annotations

from dataclasses import dataclass

from .field_rules import FieldRule, harmless, refused, used

#: What the first column of the numbers is.
TIME, SEQUENCE = "time", "sequence"


@dataclass(frozen=True)
class Instrument:
    """Signs, lines and fields of one family of files. Patterns are compared with whole cells,
    without case.

    Names stand in the `heading`, the line directly above the columns, known by its first cell, or,
    without one, in the line above the `units`; or as values of a field (`names`; the first that the
    file has). `units` are first cells of lines of units; where they say none, units stand in
    brackets, in the names (`label`, with groups name and unit) or in a line below the heading.
    `step`, `rate`, `start` and `samples` are fields, also cells such as `tInc = 1e-5` of the
    heading and numbers below its names. `first` is the first column, where the instrument does not
    call it time. `beside`: the settings stand in the first three columns, time and the channel in
    the next two.
    """

    name: str
    signs: tuple[str, ...]
    heading: str = ""
    names: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    label: str = ""
    time_unit: str = ""
    first: str = ""
    step: str = ""
    rate: str = ""
    start: str = ""
    samples: str = ""
    beside: bool = False
    fields: tuple[FieldRule, ...] = ()

    @property
    def rules(self) -> tuple[FieldRule, ...]:
        """What becomes of each field, those that give names, units, rate, start and length
        first."""
        places = (
            *((name, "names of the channels") for name in self.names),
            *(
                (name, "units of the channels")
                for name in self.units
                if self.names or self.time_unit
            ),
            (self.time_unit, "unit of time"),
            (self.step, "step between samples"),
            (self.rate, "sampling rate"),
            (self.start, "time of the first sample"),
            (self.samples, "number of samples: a shorter file is refused as cut"),
        )
        return tuple(used(name, reason) for name, reason in places if name) + self.fields


_SCREEN = "sets the picture on the screen; the numbers are in the stated unit"
_APPLIED = "is contained in the numbers already"
_TIMED = "the time column says it"
_ABOUT = "describes the instrument"
_SEGMENTS = "its segments would be read as one record; export one segment a file"
#: What oscilloscopes of all makers write of their screens.
SCREEN_FIELDS = tuple(
    harmless(name, _SCREEN)
    for name in ("Vertical Scale", "Vertical Offset", "Horizontal Scale", "Horizontal Offset")
)

INSTRUMENTS: tuple[Instrument, ...] = (
    Instrument(
        "Rigol DS1000Z, DS2000, DS4000, MSO: a sequence number, start and increment in the heading",
        signs=("X", "Sequence", "Start", "Increment"),
        heading="X",
        units=("Sequence",),
        first=SEQUENCE,
        start="Start",
        step="Increment",
    ),
    Instrument(
        "Rigol MSO5000, MSO7000, MSO8000, DHO: start and step in the heading",
        signs=(r"t0 *=.*", r"tInc *=.*"),
        heading=r"(CH\d|D\d|MATH\d|REF\d).*",
        label=r"(?P<name>(?:CH|D|MATH|REF)\d+)(?P<unit>[A-Za-z]*)",
        start="t0",
        step="tInc",
    ),
    Instrument(
        "Rigol DS1000 with settings above",
        signs=("Number of Data points", "Channel Data", r"Time \(s\)"),
        names=("Channel Data",),
        units=(r"Time \(s\)",),
        first=TIME,
        rate="Sampling Frequency (Hz)",
        samples="Number of Data points",
        fields=(
            harmless("Time Scale (s/DIV)", _SCREEN),
            harmless("Time Delay (s)", _TIMED),
            harmless("Attenuation", _APPLIED),
            harmless("Pos*", _SCREEN),
            harmless("Scale*", _SCREEN),
            harmless("Inverted", "the numbers are those of the screen, inverted or not"),
            harmless("Minimum (V)", "follows from the numbers"),
            harmless("Maximum (V)", "follows from the numbers"),
        ),
    ),
    Instrument(
        "Rigol UltraScope",
        signs=("X", r"CH ?\d+ \([A-Za-z]+\)"),
        heading="X",
        first=TIME,
    ),
    Instrument(
        "Siglent SDS",
        signs=("Record Length", r"Analog:.*", "Second"),
        names=("Source", "Vertical Scale"),
        units=("Second", "Vertical Units"),
        first=TIME,
        step="Sample Interval",
        rate="Sample Rate",
        samples="Record Length",
        fields=(harmless("Horizontal Units", "the line above the numbers says the unit of time"),),
    ),
    Instrument(
        "Rigol DS1000B, DS1000D, DS1000E; Keysight and Agilent "
        "InfiniiVision; Siglent without settings",
        signs=("Seconds?", r"Volts?|Amperes?|Amps?|Watts?|Unknown|Value"),
        units=("Seconds?",),
        first=TIME,
    ),
    Instrument(
        "Keysight Infiniium: one channel, with XInc and XOrg above",
        signs=(r"XInc:,.*", r"XOrg:,.*"),
        units=("YUnits",),
        time_unit="XUnits",
        step="XInc",
        start="XOrg",
        samples="Points",
        fields=(
            refused("Count", _SEGMENTS, "1"),
            *(harmless(name, _APPLIED) for name in ("YInc", "YOrg")),
            *(
                harmless(name, _SCREEN)
                for name in ("XRange", "XOffset", "YRange", "YOffset", "YData*")
            ),
        ),
    ),
    *(
        Instrument(
            f"GW Instek GDS: one channel, mode {mode}",
            signs=("Memory Length", "Sampling Period", "Mode", mode),
            names=("Source",),
            units=("Vertical Units",),
            first=first,
            time_unit="Horizontal Units",
            step="Sampling Period",
            samples="Memory Length",
            fields=(harmless("Probe", _APPLIED), harmless("Horizontal Position", _SCREEN)),
        )
        for mode, first in (("Fast", ""), ("Detail", TIME))
    ),
    Instrument(
        "Tektronix TDS: settings beside the samples",
        signs=("Record Length",),
        beside=True,
        names=("Source",),
        units=("Vertical Units",),
        time_unit="Horizontal Units",
        step="Sample Interval",
        samples="Record Length",
        fields=(
            harmless("Yzero", _APPLIED),
            harmless("Probe Atten", _APPLIED),
            refused(
                "Pt Fmt", "it keeps two values for each point; save again with point format Y", "Y"
            ),
        ),
    ),
    Instrument(
        "Tektronix MDO, MSO, DPO: settings above the columns",
        signs=(
            "Model|Waveform Type|Point Format|Sample Interval",
            "Vertical Units",
            r"TIME( ?\(\w+\))?",
        ),
        heading=r"TIME( ?\(\w+\))?",
        units=("Vertical Units",),
        time_unit="Horizontal Units",
        step="Sample Interval",
        samples="Record Length",
        fields=(
            harmless("Horizontal Delay", _TIMED),
            harmless("Probe Attenuation", _APPLIED),
            harmless("Threshold Used", "is the level between the states of digital channels"),
            harmless("Gating", "a part that was chosen is shorter than the record"),
            refused("FastFrame Count", _SEGMENTS, "1"),
            refused(
                "Point Format",
                "it keeps two values for each point; save again with point format Y",
                "Y",
            ),
        ),
    ),
    Instrument(
        "Yokogawa DL, DLM, ScopeCorder: ASCII with header",
        signs=("TraceName", "HResolution"),
        names=("TraceName",),
        units=("VUnit",),
        time_unit="HUnit",
        step="HResolution",
        rate="SampleRate",
        start="HOffset",
        samples="BlockSize",
        fields=(
            refused("BlockNumber", _SEGMENTS, "1"),
            harmless("Display*", _SCREEN),
            harmless("VDataType", "the numbers are written out"),
            harmless("VResolution", _APPLIED),
            harmless("VOffset", _APPLIED),
            harmless("VScale*", _SCREEN),
            harmless("Header Size", "counts the lines of the header"),
            harmless("Time", "is the time of day of the trigger"),
        ),
    ),
    Instrument(
        "Hioki Memory HiCorder: text with SIGNAL and VERT_UNITS",
        signs=("SIGNAL", "VERT_UNITS"),
        names=("SIGNAL",),
        units=("VERT_UNITS",),
        step="INTERVAL",
        fields=(
            harmless("HORZ_UNITS", "VERT_UNITS says the unit of each column, of time too"),
            harmless("NUM_SIGS", "the columns are counted"),
            harmless("TIME", "is the time of day"),
        ),
    ),
    Instrument(
        "Hioki Memory HiCorder: CSV with Trigger Time",
        signs=("Title comment", "Trigger Time", "Time"),
        heading="Time",
        first=TIME,
        fields=(
            harmless("Trigger Time", "is the time of day"),
            harmless("Scaling", _APPLIED),
            harmless("Ratio", _APPLIED),
            harmless("Offset", _APPLIED),
        ),
    ),
    Instrument(
        "Rohde & Schwarz RTB, RTM, RTA, HMO, MXO",
        signs=("in s", r".+ in \S+"),
        heading="in s",
        label=r"(?P<name>.+) in (?P<unit>\S+)",
        first=TIME,
    ),
    Instrument(
        "PicoScope 6 and 7",
        signs=("Time", r"Channel [A-H]", r"\([mnuµμ]?s\)"),
        heading="Time",
    ),
    Instrument(
        "LeCroy WaveSurfer, WaveRunner, HDO",
        signs=(r"LECROY.*", "Segments", "Time"),
        heading="Time",
        samples="SegmentSize",
        fields=(
            refused("Segments", _SEGMENTS, "1"),
            harmless("Segment", "heads the list of trigger times"),
            harmless("#*", "is the time of day of the trigger"),
            harmless("LECROY*", _ABOUT),
        ),
    ),
    Instrument(
        "HBM catman: ASCII",
        signs=(r"Time\b.*sample rate.*",),
        heading=r"Time\b.*",
        first=TIME,
    ),
    Instrument(
        "Dewesoft: text",
        signs=(r"Store type: .*", r"Time \(m?s\)"),
        heading=r"Time \(m?s\)",
        rate="Sample rate",
        fields=(
            harmless("Start time", "is the time of day"),
            harmless("Store type", "reduced values contradict the sample rate, which is refused"),
        ),
    ),
)

#: The header that Rohde & Schwarz RTO, RTE and RTP write into a file of its own, beside the
#: `.Wfm.csv` of the numbers.
HEADER_FILE = Instrument(
    "Rohde & Schwarz RTO, RTE, RTP: header in a file beside NAME.Wfm.csv",
    signs=("SignalResolution",),
    names=("MultiChannelSource", "Source"),
    units=("BaseUnit",),
    step="SignalResolution",
    start="HardwareXStart",
    samples="SignalHardwareRecordLength",
    fields=(
        harmless("Resolution", "is the step on the screen"),
        harmless("XStart", "is the start on the screen"),
        harmless("XStop", "is the end on the screen"),
        harmless("HardwareXStop", "follows from start, step and number"),
        harmless("RecordLength", "is the number on the screen"),
        harmless("SignalRecordLength", "is the number on the screen"),
        refused("NumberOfAcquisitions", _SEGMENTS, "1"),
        refused("NofAcquisitions", _SEGMENTS, "1"),
        refused(
            "SignalType", "it is no record over time", "Normal", "Source", "eRS_SIGNAL_TYPE_NORMAL"
        ),
        harmless("*Vertical*", _SCREEN),
        harmless("*Division*", _SCREEN),
        harmless("*Quantisation*", _APPLIED),
        harmless("*Probe*", _APPLIED),
        harmless("TriggerOffset", "HardwareXStart says when the samples were taken"),
        harmless("TimeScale", _SCREEN),
        harmless("*Horizontal*", _SCREEN),
        harmless("HWRecordLength", "is the number in memory"),
        harmless("Decimation*", "is contained in the step"),
        harmless("RescaleCenterTime", "is the middle of the screen"),
    ),
)
