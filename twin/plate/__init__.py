"""The resonant plate: modes of a polygon or of a measured table, and its response to a force."""
