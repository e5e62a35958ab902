"""`pyroshock db`: keeping a store, a command a file."""
