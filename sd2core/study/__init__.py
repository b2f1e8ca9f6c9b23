"""Studies of whether synthetic data help a classifier on a real radar."""
