"""Reading and writing safely: atomic writes, locks, digests, paths, bundled resources."""
