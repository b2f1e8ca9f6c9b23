"""The bundled sample: a drawn body that swipes, and its radar signal."""
