"""
Toleranced motions: balls of affine displacements, orbits of features, contact.

[SW] is Schroecker, Weber: Guaranteed Collision Detection With Toleranced Motions, 2014. Names are
the paper's; where its print is wrong, the docstring says so and derives what is right.
"""
