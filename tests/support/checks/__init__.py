"""What a thing is held to: an estimator, a page, a PDF."""
