"""The virtual impact: a chain of masses from impactor to plate, solved in time.

rear mass - neck - front mass with tip - contact (and insulator) - anvil - joint - plate as a dashpot.

The contact is elastic-plastic (Thornton) with relaxation (Lee and Radok); the insulator is an elastic foundation
with retardation. None of these laws is the one that the rest of the package uses.
"""
