"""What a user of the library imports, room by room: the modules whose names the reference tells.

The rest is how these do it. Rows of the store are not here: the page of tables tells their columns.
"""

from __future__ import annotations

ROOMS: dict[str, tuple[str, ...]] = {
    "app.library": (
        "store", "errors", "ingestion", "recordings", "spectra", "plans", "training", "contact_model", "twin",
        "prediction", "tuning", "validation", "diagnosis",
    ),
    "schema": (
        "session", "engine", "addresses", "listings", "conditions", "series", "known_factors", "configurations",
        "materials", "atomic_write", "migrate",
        "roles", "care.checking", "care.findings", "care.copying", "carry.export",
        "carry.importing",
    ),
    "parallel": ("executor", "map_tasks"),
    "signals": (
        "units", "channel", "contact", "checks", "checks.base", "shock_figures", "srs.spectrum", "srs.record",
        "srs.grid", "srs.ramp_invariant", "srs.oscillator", "srs.moments",
    ),
    "ingest": (
        "load", "report", "errors", "folder", "runs", "settings", "readers", "readers.base",
        "segmentation", "pulses", "spline", "transfer_function",
        "deconvolution", "delay", "deceleration", "impact_speed", "laser", "tank_pressure", "gunshot", "processing",
        "channel_figures", "shock_events", "force_source", "derived_force", "stored", "reextract", "repair",
        "plan_link",
    ),
    "doe": (
        "factors", "space", "designs.base", "designs.lhs", "designs.factorial", "designs.imported", "designs.augment",
        "order", "changeovers", "guards", "limits.bench", "limits.ballistic", "limits.bolts", "limits.contact_force",
        "limits.suspension", "merit.quality", "merit.balance", "merit.space_filling", "plans", "sheet",
    ),
    "dataset": (
        "predictors", "sources", "table", "selection", "snapshot", "catalog", "splits", "domain", "correlation",
        "provenance", "stored_bench",
    ),
    "training": (
        "model_catalogue", "session", "estimators.base", "models.base", "models.model_kinds", "models.serialization",
        "metrics.errors",
        "metrics.summary", "metrics.cost", "metrics.reconstruct", "metrics.significance", "floor", "comparison",
        "difference", "evaluation", "groups", "promotion", "records", "model_storage", "registry.registry", "listing",
        "contact_stage", "thesis", "gp.multitask", "gp.marginal_likelihood", "gp.maximise",
        "gp.kernels", "gp.kronecker", "gp.posterior",
    ),
    "twin": (
        "chain", "setting", "prediction", "uncertainty", "materials", "effects", "launch",
        "contact_interface",
        "plates", "gun.bench", "gun.nominal", "gun.shot", "gun.shots", "gun.effect", "gun.measured",
        "gun.leakage", "gun.prior", "gun.limits",
        "gun.calibration", "contact.bodies", "contact.pulse", "contact.laws", "contact.hertz",
        "contact.hunt_crossley", "contact.hunter", "contact.reed", "contact.von_hann", "contact.impact",
        "contact.impacts", "contact.effect", "contact.stage", "contact.unloading", "contact.yielding",
        "contact.restitution.base", "contact.restitution.zener", "contact.restitution.weir_tallon",
        "contact.restitution.measured", "plate.build", "plate.damping", "plate.edges", "plate.modes", "plate.modal",
        "plate.table", "plate.respond", "plate.response", "plate.cache", "plate.effect", "sensors.chain",
        "sensors.effect", "srs.target", "srs.target_csv", "srs.tolerance", "srs.comparison",
        "tune.space", "tune.goal", "tune.forward", "tune.tuner", "tune.probability",
        "tune.search", "iso18571",
    ),
    "diagnosis": (
        "diagnose", "options", "record", "reading.campaign", "reading.folder", "plausibility",
        "plausibility.unit_factors", "chain", "observables.base", "observables.gun.stage",
        "observables.contact.stage", "observables.contact.registered_model", "observables.plate.stage", "gap",
        "gap_size", "noise", "inference.problem", "inference.effect_laws",
        "inference.model_search", "inference.posterior", "inference.held_out", "inference.shares", "conclusion",
        "probability_maps", "next_runs", "verdict", "gap_reduction.measure",
        "gap_reduction.pulse_ratings", "localisation.stages",
    ),
    "validation": (
        "blind_check", "report", "cases.case", "cases.draw", "cases.record", "cases.sealing",
    ),
    "virtualbench": (
        "simulate", "effects", "recorder", "seal", "gun.build", "gun.fire", "gun.truth", "gun.quick", "impact.build",
        "impact.impactors", "impact.materials", "impact.strike", "plate.build", "plate.resonant", "plate.modes",
        "plate.respond", "plate.table", "sensors.build", "sensors.chain",
    ),
}  # fmt: skip
