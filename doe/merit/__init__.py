"""The quality of a design: balance, spread, and what a model can be fitted to."""

from .quality import FIGURES, FigureComparison, Quality, compare, quality

__all__ = ["FIGURES", "FigureComparison", "Quality", "compare", "quality"]
