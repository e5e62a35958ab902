"""Effects of the sensors stage, one a file; a new one is found by being here."""
