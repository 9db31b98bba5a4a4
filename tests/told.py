"""What remarks say, for tests."""


def texts(remarks):
    """Texts of remarks, in order."""
    return tuple(remark.text for remark in remarks)
