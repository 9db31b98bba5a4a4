"""Inverse kinematics: joint angles from labelled markers."""
