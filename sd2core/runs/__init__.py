"""Runs: processes that work in a folder, through which they are followed and steered."""
