"""BVH: a hierarchy of joints as text, in by any program, out of our joint trees."""
