"""Figures as data, and the two renderers that draw them: on pages and by matplotlib."""
