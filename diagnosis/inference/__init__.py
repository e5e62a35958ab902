"""Bayesian inference over all effects of the catalogue together: which act, how strongly, and what
they leave."""
