"""What an enDAQ or Slam Stick recording can say beside its samples: elements of the maker's schema
`mide_ide`."""

from __future__ import annotations

from .field_rules import FieldRule, harmless, used

IDE_FIELDS: tuple[FieldRule, ...] = (
    used("CalibrationList",
    "polynomials of one or two channels, which the maker's library applies to the samples"),
    used("ChannelCalibrationIDRef", "which polynomial a channel has"),
    used("SubChannelCalibrationIDRef", "which polynomial a part of a channel has"),
    used("SubChannelUnits", "the unit of the samples after calibration"),
    used("SubChannelLabel", "the channel's name"),
    used("SubChannelAxisName", "the channel's name, where it has no label"),
    used("SensorName", "handed on as a note"),
    used("TimeCodeScale", "seconds per tick of the times of blocks"),
    used("TimeCodeModulus", "after how many ticks the times of blocks begin again"),
    used("StartTimeCodeAbs*", "the start of a block: each channel has its own times, on one clock"),
    used("EndTimeCodeAbs*", "the end of a block"),
    used("ChannelFormat", "type of the raw samples"),
    used("SampleRate", "between blocks, where a block says no end"),
    harmless("TimeBaseUTC",
    "when the recording began, to the second; all channels are on its clock"),
    harmless("Recorder*", "name, type and serial number of the recorder"),
    harmless("Product*", "name of the recorder"),
    harmless("PartNumber", "of the recorder"),
    harmless("HwRev*", "of the recorder"),
    harmless("FwRev*", "of the recorder"),
    harmless("Mcu*", "of the recorder"),
    harmless("Unique*", "of the recorder"),
    harmless("Date*", "when the recorder was made"),
    harmless("Calibration*", "date, expiry and serial number of the calibration that is applied"),
    harmless("SubChannelRange*", "the range that a viewer shows"),
    harmless("SubChannelWarningRef", "where a viewer warns of temperatures beyond the sensor's"),
    harmless("ChannelDataBlock mean", "a viewer may subtract it; samples are handed on with it"),
)  # fmt: skip
