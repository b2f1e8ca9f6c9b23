"""Files of others read into, and written from, the core's own types."""
