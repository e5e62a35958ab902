"""How a question comes in: command line, JSON, forms, jobs and Python. No door knows an operation."""
