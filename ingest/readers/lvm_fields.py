"""What a LabVIEW measurement file can say: keys of its header and of a segment (NI, "Specification
for the LabVIEW Measurement File")."""

from __future__ import annotations

from .field_rules import FieldRule, harmless, refused, used

LVM_FIELDS: tuple[FieldRule, ...] = (
    used("Separator", "between the fields: Tab or Comma"),
    used("Decimal_Separator", "of the numbers"),
    used("Multi_Headings", "`No`: one heading for many writes, whose gaps the X column must tell"),
    used("X_Columns", "`No` or `One` column of X values; `Multi` is refused"),
    used("Channels", "the number of channels"),
    used("Samples", "the samples of each channel; of one write with one heading for many"),
    used("Date",
    "with `Time`, the absolute start of each channel; starts are compared across channels"),
    used("Time", "with `Date`, the absolute start of each channel"),
    used("X_Dimension", "the quantity of the x axis: a channel over frequency or angle is refused"),
    used("X_Unit_Label", "the unit of the x axis: s, ms, us, ns, min, h; any other is refused"),
    used("X0", "the start after `Date` and `Time`, in the unit of the x axis"),
    used("Delta_X", "the step, in the unit of the x axis; it must agree with the X column"),
    used("Y_Unit_Label", "the unit of the samples"),
    harmless("Y_Dimension", "the quantity, which campaign.toml names"),
    harmless("Time_Pref",
    "whether a viewer shows time relative or absolute; the start is read from its own keys"),
    harmless("*_Version", "the version of the format"),
    harmless("Operator", "a text"),
    harmless("Description", "a text"),
    harmless("Project", "a text"),
    harmless("Notes", "a text"),
    harmless("Comment", "a text beside the samples"),
    harmless("Test_*", "name, series and numbers of the test"),
    harmless("UUT_*", "name and numbers of the unit under test"),
    harmless("Segments", "counted by the library; several are refused"),
    refused("Scaling*", "the samples are not scaled; export them scaled", "", "none", "1"),
)  # fmt: skip
