"""The start page, pictures of recordings, and the tour of the sample."""
