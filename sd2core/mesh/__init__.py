"""Moving meshes: positions and times, presence of a person, uncertainty, decimation."""
