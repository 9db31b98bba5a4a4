"""HDF5 files: sessions, subjects, priors; walked in a process of their own."""
