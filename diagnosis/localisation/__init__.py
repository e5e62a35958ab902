"""Where the gap lies: in which stage, where in the space of factors, when, at which frequencies,
and since when."""
