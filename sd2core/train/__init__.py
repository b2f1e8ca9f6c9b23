"""Training of denoisers in run folders, and their evaluation."""
