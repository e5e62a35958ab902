"""Checks of a store that need more than its tables: datasets and models."""
