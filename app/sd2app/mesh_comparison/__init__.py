"""Two meshes of one video side by side."""
