"""A person's body: found in a video, as a surface that can be shaped and posed."""
