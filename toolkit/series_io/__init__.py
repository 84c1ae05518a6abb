"""Formats of θ(t) files, one file each."""
