"""The virtual bench: an independent simulator that writes campaign folders as a real bench would.

It knows nothing of the rest of the package and uses other laws and integrators than `twin`, so that
agreement between the two means something.
"""
