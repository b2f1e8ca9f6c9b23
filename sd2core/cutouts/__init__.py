"""Cut-outs: a folder per labelled span with its video, mesh and maps."""
