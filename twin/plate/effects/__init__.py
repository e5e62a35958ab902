"""Effects of the plate stage, one a file; a new one is found by being here."""
