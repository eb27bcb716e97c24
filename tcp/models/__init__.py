"""Formulations only: variables, constraints, objective.  No policy, no input or output."""
