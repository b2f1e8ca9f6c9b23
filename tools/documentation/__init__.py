"""Scripts that write the measured pages of ``docs/`` and their pictures."""
