"""Nominal laws of contact: impact velocity and bodies to a force pulse."""
