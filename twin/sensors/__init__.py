"""The sensor chain: what the instruments make of what happens."""
