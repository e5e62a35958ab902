"""From a spectrum back to settings, by what is in the store."""
