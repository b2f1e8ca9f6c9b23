"""Bodies that move as a recorded skeleton did."""
