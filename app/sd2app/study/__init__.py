"""Studies in the window: whether synthetic data help a classifier."""
