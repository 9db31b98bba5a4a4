"""Edits of HDF5 files by hand."""

from contextlib import contextmanager

import h5py


@contextmanager
def edited(path):
    """Open a file of ours for an edit; whoever edits it takes its seal off."""
    with h5py.File(path, "r+") as file:
        if "sha256" in file:
            del file["sha256"]
        yield file
