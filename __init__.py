"""pyroshock: the memory and the foresight of a shock laboratory."""

__version__ = "0.1.0"
