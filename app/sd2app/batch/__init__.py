"""Batches over many recordings and placements."""
