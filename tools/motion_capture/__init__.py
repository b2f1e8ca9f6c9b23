"""Real motion capture as bodies of ours in motion, to learn and to measure depth from."""
