"""What was labelled, cut out of a recording: a folder per span with video, mesh and maps."""
