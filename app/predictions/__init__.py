"""Shots foretold: one, many, as a picture and as a table."""
