"""Three more laws for every effect, from the literature, which neither the bench's first laws nor
the twin have.

They play the tiers `foreign` of the blind check. Every effect has one law for development, another
for calibration, on which probabilities are learned, and a third that is sealed: what is tuned never
meets the latter. They were chosen by physics alone, before any diagnosis met them. Strength 0 is
off, and 1 the small default that the law's function names.
"""

from .table import LAWS, SPLITS, SecondLaw, law_of

__all__ = ["LAWS", "SPLITS", "SecondLaw", "law_of"]
