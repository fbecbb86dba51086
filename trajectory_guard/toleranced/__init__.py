"""Toleranced motions [Schroecker & Weber 2014]: balls of displacements, orbits, contact."""
