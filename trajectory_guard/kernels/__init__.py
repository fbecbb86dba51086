"""
Numba functions on arrays: no objects, no exceptions, no allocation that a caller does not see.

Layer contract.  A kernel takes arrays that the core has validated (finite, contiguous float64 or
int64), writes into arrays of the caller and returns numbers.  Arithmetic is IEEE double with
``error_model='numpy'`` and without any fast-math flag, so NaN and infinity propagate, and every
comparison that certifies is written so that NaN fails it.

*Trusted* (a wrong line here could call a collision free): ``piece`` (polynomials of a piece and
the half-angle fit), ``chain`` (control matrices of the links), ``reach`` (lever arms),
``separation`` (the inequality that separates), ``margin`` (rounding), ``cover`` (which pairs and
pieces are closed). *Untrusted*, may only propose: ``gjk``, ``deepest``.

Shared conventions: a pose is 12 numbers, the rows of a 3x4 matrix ``[R | t]``; ``tau`` runs over
[-1, 1] on a piece; a *node* is a movable joint, its frame moves with the joint and has the joint
axis as z.
"""
