"""What a WAV file can say beside its samples: its chunks, and the fields of `fmt ` (Microsoft,
"Multiple channel audio data and WAVE files"; EBU Tech 3285)."""

from __future__ import annotations

from .field_rules import FieldRule, harmless, refused, used

_CURE = "read the file with its maker's software, and export samples to which this is applied"

WAV_FIELDS: tuple[FieldRule, ...] = (
    used("fmt ", "format, channels, sampling rate and bits of a sample"),
    harmless("valid bits",
    "bits in use of a sample: they are its upper ones, so that full scale stays"),
    harmless("channel mask", "loudspeakers of the channels"),
    used("data", "the samples"),
    harmless("fact", "the number of samples, which are counted"),
    harmless("PEAK", "the greatest sample, for a viewer"),
    harmless("LIST", "texts"),
    harmless("INFO", "texts"),
    harmless("bext", "description and time of the recording; all channels begin together"),
    harmless("iXML", "names of tracks and the scene"),
    harmless("axml", "a description"),
    harmless("_PMX", "a description"),
    harmless("id3 ", "a description"),
    harmless("cue ", "marks"),
    harmless("plst", "the order in which marks are played"),
    harmless("adtl", "texts of marks"),
    harmless("labl", "texts of marks"),
    harmless("note", "texts of marks"),
    harmless("ltxt", "texts of marks"),
    harmless("smpl", "loops of a sampler"),
    harmless("inst", "settings of a sampler"),
    harmless("acid", "tempo of music"),
    harmless("JUNK", "room without content"),
    harmless("PAD ", "room without content"),
    harmless("FLLR", "room without content"),
    harmless("minf", "settings of an editor"),
    harmless("elm1", "settings of an editor"),
    harmless("regn", "settings of an editor"),
    harmless("umid", "an identifier"),
    refused("wavl", "samples lie in parts with silence between them; " + _CURE),
    refused("slnt", "silence is stated in place of samples; " + _CURE),
    refused("cal*", "a calibration is stated; " + _CURE),
    refused("scal*", "a scale is stated; " + _CURE),
    refused("gain", "a gain is stated; " + _CURE),
)  # fmt: skip
