"""A mesh of another program: seen over the video before it is taken."""
