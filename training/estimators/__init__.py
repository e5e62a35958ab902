"""Regressions of several outputs on the predictors, one family a file, behind one interface."""
