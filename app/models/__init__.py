"""Datasets and registered models: trained, compared, shown."""
