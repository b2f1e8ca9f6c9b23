"""Many recordings × placements: fit, synthesise, denoise and export them on many processes."""
