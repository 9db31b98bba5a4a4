"""A personal hand from a scan: Schroeder et al. 2017, "Hand model generation"."""
