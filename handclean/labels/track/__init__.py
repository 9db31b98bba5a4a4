"""A target followed from frame to frame: the state, the fit, what is refused."""
