"""Files in, files out; many takes."""
