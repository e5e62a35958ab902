"""Shock response spectra after ISO 18431-4, and what a laboratory asks of them."""
