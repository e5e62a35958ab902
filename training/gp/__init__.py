"""Gaussian processes: kernels, exact marginal likelihoods, posteriors."""
