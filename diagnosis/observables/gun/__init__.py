"""What the gun shows, measured and simulated."""
