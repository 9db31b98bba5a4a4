"""The benchmark of gap filling; see handclean's README, "Judging fillers"."""
