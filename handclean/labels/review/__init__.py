"""A tracked take looked at again: frames and paths of points in doubt."""
