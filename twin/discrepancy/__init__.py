"""How far measured spectra lie from predicted ones, as a Gaussian process over settings and
lines."""
