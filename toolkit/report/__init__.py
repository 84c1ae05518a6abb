"""One Report value, several writers."""
