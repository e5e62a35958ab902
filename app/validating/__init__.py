"""`validate`: each measured shot of a campaign beside a prediction of a twin that had not seen it."""
