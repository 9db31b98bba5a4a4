"""Takes with known truth: postures, motion, cameras, noise, ghosts."""
