"""Effects of the contact stage, one a file; a new one is found by being here."""
