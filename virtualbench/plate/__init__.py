"""The virtual resonant plate: a Mindlin plate of spectral elements, its modes, and its response to
a force."""
