"""Checks of the assumptions of a pendulum experiment, one file a check."""
