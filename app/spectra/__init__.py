"""Shock response spectra of recordings and of stored impacts."""
