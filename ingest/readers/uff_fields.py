"""What a data set 58 of the universal file format can say, by the names of pyuff: records 1 to 11
of the standard."""

from __future__ import annotations

from .field_rules import FieldRule, harmless, refused, used

UFF_FIELDS: tuple[FieldRule, ...] = (
    used("id1", "record 1, the name of the channel where all differ"),
    harmless("id[2-5]",
    "records 2 to 5, texts; a date in them is that of the export, to the second"),
    used("func_type",
    "record 6: 0 and 1 are read; a set of any other function (spectrum, transfer function) is not"),
    harmless("func_number", "record 6, the function's identification number"),
    harmless("ver_num", "record 6, version or sequence number"),
    harmless("load_case_id", "record 6, the load case"),
    used("rsp_ent_name", "record 6, part of the channel's name"),
    used("rsp_node", "record 6, part of the channel's name"),
    used("rsp_dir", "record 6, part of the channel's name"),
    harmless("ref_*", "record 6, the reference, which a time response does not have"),
    used("ord_data_type",
    "record 7, real or complex, single or double; complex samples are refused"),
    used("num_pts", "record 7, the samples of the set; fewer are refused"),
    used("abscissa_spacing", "record 7, 1: by increment, 0: each sample has its abscissa"),
    used("abscissa_min", "record 7, the start in the unit of the abscissa"),
    used("abscissa_inc", "record 7, the step in the unit of the abscissa"),
    harmless("z_axis", "record 7, the place in a series of functions"),
    used("abscissa_spec_data_type",
    "record 8: time, or unknown and named as time; frequency, rpm, order are refused"),
    used("abscissa_axis_lab", "record 8, the name of the abscissa where its type is unknown"),
    used("abscissa_axis_units_lab",
    "record 8, s, ms, us, ns, min or h; none is s; any other is refused"),
    harmless("abscissa_*_unit_exp", "record 8, of abscissas that are no time"),
    harmless("ordinate_spec_data_type", "record 9, the quantity, which campaign.toml names"),
    harmless("ordinate_*_unit_exp",
    "record 9, relevant without a unit label only; the unit is then asked for"),
    harmless("ordinate_axis_lab", "record 9, the quantity, which campaign.toml names"),
    used("ordinate_axis_units_lab", "record 9, the unit of the samples"),
    refused("orddenom_axis_units_lab",
    "record 10: the samples are a ratio; export the signal itself", "", "NONE"),
    harmless("orddenom_*", "record 10, without a unit the ordinate is no ratio"),
    harmless("z_axis_*", "record 11, of a series of functions"),
    harmless("type", "58"),
    harmless("binary", "how the samples are written"),
    harmless("byte_ordering", "how binary samples are written"),
    harmless("fp_format", "how binary samples are written"),
    harmless("n_ascii_lines", "how binary samples are written"),
    harmless("n_bytes", "how binary samples are written"),
)  # fmt: skip
