"""From the active effects to one equation, and from the equation to its solution."""
