"""Certified collision freedom for the motion a controller really plays."""
