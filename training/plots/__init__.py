"""Pictures of how models do; matplotlib is loaded when one is drawn."""
