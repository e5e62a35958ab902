"""What a model was trained on: predictors, targets, frozen snapshots, splits and the domain they
are valid in."""
