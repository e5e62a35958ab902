"""Search for settings: a genetic algorithm for networks, Bayesian optimisation for the contact-time
process."""
