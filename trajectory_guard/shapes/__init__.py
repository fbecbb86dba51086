"""Solids: primitives, hulls and meshes, what contains them and what lies inside."""
