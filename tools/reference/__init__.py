"""The reference of the documentation, made from the code when the site is built: one subject a
file."""
