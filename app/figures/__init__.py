"""Figures as data, their renderers, and their makers, each in a file of its subject."""
