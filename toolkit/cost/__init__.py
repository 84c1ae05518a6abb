"""What accuracy costs in time, one subject a file; each has `measure(folder, quick, progress) -> text`."""
