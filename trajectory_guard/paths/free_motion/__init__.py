"""Rational motions of free bodies from what people have: quaternions, keyframes, splines."""
