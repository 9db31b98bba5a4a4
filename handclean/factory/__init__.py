"""What makes the shipped data, the samples and the pictures; users run none of it."""
