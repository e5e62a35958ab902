"""Long work as rows of the store: asked for by one process, done by whichever worker is free,
once."""
