"""How far the gap shrinks on configurations that neither the choice of a cause nor its parameters have seen."""
