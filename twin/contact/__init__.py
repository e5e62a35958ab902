"""The contact: impact velocity and bodies to a force pulse, by nominal laws or by a motion with
effects."""
