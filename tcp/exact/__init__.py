"""What proves: each file one solver whose answer is an optimum with a bound."""
