"""The virtual gun: gas dynamics of tank, valve, barrel and clearance, in absolute pressures."""
