"""A body driven by a recorded skeleton."""
