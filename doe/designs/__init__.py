"""One way of choosing treatments per file; each gives a `base.Design`."""
