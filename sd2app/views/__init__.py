"""Widgets. They show models and hold no truth of their own."""
