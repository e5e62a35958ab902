"""Effects of the gun stage, one a file; a new one is found by being here."""
