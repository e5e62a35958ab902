"""What the bench withstands: the thesis's chapter 2 as functions, and the limits of one bench as
data."""
