"""A campaign as its pages and tables show it."""
