"""Curves in the space of displacements, with a bound on their error."""
