"""What the contact shows, measured and simulated."""
