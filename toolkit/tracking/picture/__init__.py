"""What one picture shows: what is looked at, the still background and what stands before it, the string, spots on the bob."""
