"""Diagnoses of the sim-to-real gap: made, kept, and the experiment that they name."""
