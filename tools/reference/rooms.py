"""What a user of the library imports, room by room: the modules whose names the reference tells.

The rest is how these do it. Rows of the store are not here: the page of tables tells their columns.
"""

from __future__ import annotations

ROOMS: dict[str, tuple[str, ...]] = {
    "app": (
        "library.experiment_store", "library.plans", "library.laboratory_twin", "common.errors",
        "operations.ingest.service", "operations.impacts.service",
        "operations.impacts.spectra_service", "operations.plan.service",
        "operations.train.service", "operations.train.contact_model",
        "operations.predict.service", "operations.tune.service", "operations.validate.service",
        "operations.diagnose.service",
    ),
    "schema": (
        "session", "engine", "addresses", "listings", "conditions", "series", "known_factors",
        "known_facts",
        "configurations", "benches", "migrate", "access.roles",
        "integrity.checking",
        "integrity.findings", "transfer.copying", "transfer.export", "transfer.merging",
    ),
    "files": (
        "atomic_write", "delimited_text", "number_notation", "spreadsheet_guard", "toml_text",
    ),
    "parallel": (
        "map_tasks",
    ),
    "signals": (
        "units", "channel", "checks.base", "checks", "record_rest", "record_hits", "shock_figures",
        "srs.spectrum",
        "srs.moments",
    ),
    "ingest": (
        "load", "errors",
        "folder.campaign_file", "folder.runs_table", "folder.recording_options",
        "folder.known_facts",
        "readers", "readers.base",
        "extraction.settings", "extraction.recording", "extraction.segmentation",
        "extraction.pulses", "extraction.transfer_function", "extraction.deconvolution",
        "extraction.velocity", "extraction.impact_speed", "extraction.pressure_drop",
        "extraction.gunshot", "extraction.channel_figures", "extraction.derived_force",
        "storing.report", "storing.stored_channels", "storing.shot_differences",
        "storing.reextraction", "storing.series_repair", "storing.plan_link",
    ),
    "doe": (
        "factors", "space", "designs.base", "designs.lhs", "designs.factorial", "designs.imported",
        "designs.augment", "order", "guards", "limits.bench", "limits.ballistic",
        "limits.contact_force",
        "merit.quality", "merit.space_filling", "plans", "sheet",
    ),
    "dataset": (
        "predictors", "sources", "table", "selection", "snapshot", "catalog", "domain", "rows",
    ),
    "training": (
        "models.catalogue", "fitting.session", "estimators.base", "models.base",
        "models.serialization",
        "evaluation.metrics", "evaluation.summary", "evaluation.floor", "evaluation.comparison",
        "registry.evaluate", "registry.promotion", "registry.records", "registry.model_storage",
        "registry.registry", "registry.listing", "registry.contact_stage", "gp.multitask",
        "gp.marginal_likelihood", "gp.maximise", "gp.kernels", "gp.kronecker", "gp.posterior",
    ),
    "twin": (
        "chain", "setting", "prediction", "effects", "gun.stage", "contact_interface",
        "plate.stage",
        "gun.bench", "gun.nominal", "gun.shot", "gun.shots", "gun.prior", "gun.calibration",
        "contact.bodies", "contact.pulse", "contact.laws", "contact.hertz", "contact.impact",
        "contact.impacts", "contact.stage", "contact.restitution_laws",
        "contact.measured_restitution",
        "plate.build", "plate.outline", "plate.modes", "plate.modal", "plate.table",
        "plate.response",
        "sensors.chain", "sensors.effect", "srs.standards", "srs.target", "srs.target_csv",
        "tune.space", "tune.goal",
        "tune.tuner", "tune.probability", "tune.search",
    ),
    "diagnosis": (
        "diagnose", "options", "record", "reading.campaign", "plausibility", "plausibility.units",
        "chain",
        "observables.base", "observables.gun.stage", "observables.contact.stage",
        "observables.contact.registered_model", "observables.plate.stage", "gap",
        "inference.problem",
        "inference.effect_laws", "inference.model_search", "inference.posterior",
        "inference.held_out",
        "inference.shares", "known_facts", "conclusion", "next_runs", "verdict", "gap_reduction",
        "iso18571",
        "localisation.stages",
    ),
    "validation": (
        "blind_check", "report", "cases.case", "cases.draw", "cases.record",
    ),
    "virtualbench": (
        "simulate", "effects", "recorder", "gun.build", "gun.fire", "gun.integrate", "impact.build",
        "impact.strike", "plate.build", "plate.modes", "plate.respond", "sensors.build",
        "sensors.chain",
    ),
}  # fmt: skip
