"""Nominal laws of restitution: bodies to the ratio of the velocities after and before."""
