"""Campaigns and recordings taken out of the store, with a tombstone for each."""
