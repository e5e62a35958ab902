"""Figures of what the features show, each in a file named after its subject."""
