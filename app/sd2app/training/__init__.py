"""Training of denoisers in a background process."""
