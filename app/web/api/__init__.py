"""The JSON API under /api, one theme a file; the same functions as pages and command line stand behind it."""
