"""What the attributes of HDF5, netCDF and MATLAB 7.3 can say of a data set."""

from __future__ import annotations

from .field_rules import FieldRule, harmless, refused, used
from .statements import STATEMENT_RULES

HDF5_FIELDS: tuple[FieldRule, ...] = (
    *STATEMENT_RULES,
    used("fs_hz", "the sampling rate, as `sampling_rate`, `sample_rate` and both with `_hz` are"),
    used("sampl*_rate*", "the sampling rate"),
    used("start_s", "the time of the first sample, in seconds"),
    used("units", "the unit; of time `ms`, or `seconds since` a date, whose date is left out"),
    used("scale_factor", "netCDF: value = stored * scale_factor + add_offset"),
    used("add_offset", "netCDF: value = stored * scale_factor + add_offset"),
    used("_FillValue", "netCDF: such a sample is NaN"),
    used("missing_value", "netCDF: such a sample is NaN"),
    used("valid_range", "netCDF: a sample outside is NaN, as it is beyond valid_min and valid_max"),
    used("valid_m[ia][nx]", "netCDF: a sample beyond is NaN"),
    used("_Unsigned", "netCDF: whole numbers without a sign"),
    used(
        "DIMENSION_LIST",
        "HDF5: the dimension scale of a data set, which is its time; another axis is refused",
    ),
    used(
        "MATLAB_*",
        "MATLAB 7.3: class, sparse matrices, empty arrays; objects, cells "
        "and logical arrays are refused",
    ),
    harmless("CLASS", "HDF5: marks a dimension scale"),
    harmless("NAME", "HDF5: the name of a dimension scale; one without values is no channel"),
    harmless("REFERENCE_LIST", "HDF5: the data sets of a dimension scale"),
    harmless("DIMENSION_LABELS", "HDF5: names of axes"),
    harmless("H5PATH", "MATLAB 7.3: where the variable stands"),
    harmless("_N[ce]*", "netCDF: how the library wrote the file"),
    harmless("_nc3_strict", "netCDF: how the library wrote the file"),
    harmless("*_name", "a name"),
    harmless("coordinates", "names of other variables"),
    harmless("axis", "CF: which axis a coordinate is"),
    harmless("calendar", "CF: of dates, which are left out"),
    harmless("actual_range", "netCDF: the extremes of the values"),
    refused("bounds", "the samples are means over cells; save the samples themselves", ""),
    refused(
        "cell_methods",
        "the samples are computed over cells; save the samples themselves",
        "",
        "time: point",
    ),
)
