"""C3D files: read, written, and changed without a byte moved that is not ours."""
