"""What the plate shows, measured and simulated."""
