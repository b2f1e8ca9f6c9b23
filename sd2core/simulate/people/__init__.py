"""Random people in random motion, seen by random cameras: what the lifter learns from."""
