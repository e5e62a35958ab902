"""Models of a whole contact: force over time, from regressions, from physics, and from both."""
