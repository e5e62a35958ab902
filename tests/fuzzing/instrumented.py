"""Whose branches guide the campaign: ours that read files, and the readers' libraries that are written in Python."""

from __future__ import annotations

PACKAGES = (
    *("pyroshock.ingest", "pyroshock.doe.toml_space", "pyroshock.doe.space", "pyroshock.doe.factors"),
    *("pyroshock.doe.designs.imported", "pyroshock.dataset.predictors", "pyroshock.schema.known_factors"),
    *(
        "pyroshock.schema.known_factors",
        "pyroshock.delimited_text",
        "pyroshock.signals.modal_table",
        "pyroshock.twin.plate.table",
    ),
    *(
        "pyroshock.twin.srs.target_csv",
        "pyroshock.twin.srs.target",
        "pyroshock.app.impacts.spectra",
        "pyroshock.app.twins.benches",
    ),
    *(
        "pyroshock.app.impacts.spectra",
        "pyroshock.app.ingest.uploads",
        "nptdms",
        "pyuff",
        "lvm_read",
        "zipfile",
        "tomllib",
    ),
)
