"""The Python library: what `import pyroshock as ps` offers to notebooks, and what the command line itself calls."""
