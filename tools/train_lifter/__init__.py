"""Training data, training and scores of the bundled lifter: ``resources/lifter.npz``."""
