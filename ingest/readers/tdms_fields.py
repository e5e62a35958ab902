"""What a TDMS file can say of time, scale, unit, class and gaps: properties of LabVIEW, DAQmx,
DIAdem and npTDMS.

Names are those of NI's "TDMS file format internal structure" and "Properties of TDM objects"; a
file, group or channel may have any other.
"""

from __future__ import annotations

from .contents import RATE_NAMES
from .field_rules import FieldRule, harmless, refused, used

#: Where a channel has no `unit_string`.
UNIT_NAMES = (
    "NI_UnitDescription",
    "unit",
    "units",
    "unit_name",
    "eng_units",
    "engineering_units",
    "y_unit",
)

TDMS_FIELDS: tuple[FieldRule, ...] = (
    used("wf_increment", "the step of the samples, in the unit of the x axis"),
    used("wf_start_time", "the absolute start of the channel; starts are compared across channels"),
    used("wf_start_offset", "the start after `wf_start_time`, in the unit of the x axis"),
    used("wf_xname", "the quantity of the x axis: a channel over frequency or angle is refused"),
    used("wf_xunit_string", "the unit of the x axis: s, ms, us, ns, min, h; any other is refused"),
    harmless("wf_samples", "samples of one write; the samples themselves are counted"),
    harmless("wf_time_pref",
    "whether a viewer shows time relative or absolute; the start is read from its own fields"),
    harmless("wf_xcolumns",
    "which channel a viewer takes for x; a channel of time is known by its name, unit or type"),
    harmless("xchannel",
    "which channel a viewer takes for x; a channel of time is known by its name, unit or type"),
    used("unit_string", "the unit of the samples"),
    *(used(name,
    "the unit where `unit_string` says none; two units must agree") for name in UNIT_NAMES),
    *(used(name,
    "the rate where there is no `wf_increment`; both must agree") for name in sorted(RATE_NAMES)),
    used("NI_Scaling_Status", "`unscaled` samples are scaled by the scales below"),
    used("NI_Number_Of_Scales", "the number of scales"),
    used("NI_Scale*",
    "applied: linear, polynomial, table, strain, RTD, thermistor, thermocouple, sum"),
    refused(
        "NI_function_type",
        "it is no series over time; export the time signal",
        "time signal",
        "signal",
        "time",
        "Time Signal",
        "waveform",
    ),
    harmless("NI_ChannelName",
    "the channel's name in a chart; the name of the TDMS channel is used"),
    harmless("NI_ExpStartTimeStamp",
    "when the experiment began; channels start by `wf_start_time`"),
    harmless("NI_ExpTimeStamp", "when the data were written"),
    harmless("NI_ExpIsRelativeTime", "whether a viewer shows relative time"),
    harmless("NI_DataHasBeenScaled*",
    "what the writer did before it wrote; the scales above are what is left to do"),
    harmless("NI_*_Unscaled_Unit*", "the unit before a scale"),
    harmless("datetime", "when the file was written"),
    harmless("DateTime*", "when the file was written"),
    harmless("minimum", "the least sample, for a viewer"),
    harmless("maximum", "the greatest sample, for a viewer"),
    harmless("monotony", "whether samples rise, for a viewer"),
    harmless("novaluekey",
    "whether samples are missing; missing floats are NaN, which the check of dropouts finds"),
    harmless("displaytype", "numeric or time, for a viewer"),
    harmless("description", "a text"),
    harmless("name", "a text"),
    harmless("Sensor*", "about the sensor; the samples are in `unit_string`"),
)  # fmt: skip
