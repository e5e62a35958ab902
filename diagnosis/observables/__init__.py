"""Stages of the bench as a diagnosis sees them: what was measured, what the nominal simulator says,
what effects do."""
