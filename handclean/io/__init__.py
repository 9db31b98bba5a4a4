"""Files: the only place with millimetres, degrees and formats."""
