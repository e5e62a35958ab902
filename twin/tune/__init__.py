"""From a prescribed spectrum back to settings of the bench."""
