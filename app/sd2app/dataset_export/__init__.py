"""Export of data sets to learn from."""
