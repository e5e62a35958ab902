"""The virtual impact: a chain of masses from impactor to plate, solved in time.

rear mass - neck - front mass with tip - contact (and insulator) - anvil - joint - plate as a
dashpot.

The contact is elastic-plastic (Zhao, Maietta and Chang) with relaxation (Lee and Radok), of a tip
that may be worn; the insulator is an elastic foundation with retardation. The twin has none of
these laws.
"""
