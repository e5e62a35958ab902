"""Figures of models on held-out pulses, which the registry keeps with each training."""
