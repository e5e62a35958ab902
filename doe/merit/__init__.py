"""The quality of a design: balance, spread, and what a model can be fitted to."""

from .quality import FIGURES, Quality, Row, compare, quality

__all__ = ["FIGURES", "Quality", "Row", "compare", "quality"]
