"""Keeping stores: moved between engines, checked, carried to another laboratory."""
