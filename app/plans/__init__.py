"""Plans that can be fired, their quality, and what a simulation of them shows."""
