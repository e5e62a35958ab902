"""How far predicted pulses are from measured ones, and how sure the means of it are."""
