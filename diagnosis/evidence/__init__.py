"""Which unmodelled effect explains the gap: marginal likelihoods of hypotheses before a background of small errors."""
