"""What a fit is made of: first guess, minimisation, noise, error bars, budget, and what follows from the parameters."""
