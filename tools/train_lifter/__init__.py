"""Training data, training and scores of the bundled ``lifter.npz`` and ``sides.npz``."""
