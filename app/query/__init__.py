"""Questions in SQL to the store, which change nothing."""
