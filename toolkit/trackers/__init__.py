"""Localisers of the bob, one file each."""
