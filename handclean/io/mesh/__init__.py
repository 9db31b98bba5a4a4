"""Meshes and point clouds: PLY, OBJ, STL."""
