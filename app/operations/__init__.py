"""What a person asks of the software: each operation is declared once, and every door offers it."""
