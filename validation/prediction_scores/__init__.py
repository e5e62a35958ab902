"""How well predictions with bands agree with measured shots that the twin had not seen."""
