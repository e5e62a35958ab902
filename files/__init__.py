"""How a file is read and written safely: tables, TOML, numbers as people write them, whole
files."""
