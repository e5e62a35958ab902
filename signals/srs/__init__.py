"""Shock response spectra after ISO 18431-4."""
