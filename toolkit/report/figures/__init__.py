"""The report's figures, one file each: a function of `Material` that returns a `Figure`, or None where it has nothing to show."""
