"""Deleting with what stands on it named: datasets, models, diagnoses, adopted effects."""
