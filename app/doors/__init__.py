"""How a question comes in: command line, JSON, forms and Python. No door knows an operation."""
