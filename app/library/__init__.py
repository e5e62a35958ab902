"""The Python library: what notebooks open, and the objects that they get."""
