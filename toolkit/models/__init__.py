"""What is fitted: pendulum models with their free parameters."""
