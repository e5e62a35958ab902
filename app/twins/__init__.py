"""The twin of what is in the store: its parts, its state, what can be set of it."""
