"""
Numba functions on arrays: no objects, no exceptions, no allocation that a caller does not see.

Layer contract.  A kernel takes arrays that the core has validated (finite, contiguous float64 or
int64), writes into arrays of the caller and returns numbers.  Arithmetic is IEEE double with
``error_model='numpy'`` and without any fast-math flag, so NaN and infinity propagate, and every
comparison that certifies is written so that NaN fails it.

*Trusted* (a wrong line here could call a collision free): the motion in ``piece``, ``chain``,
``economised`` and ``enclosure``; lever arms in ``reach``; the inequalities in ``separation`` and
``cull``; rounding in ``margin``; the books in ``cover``, ``pair`` and ``leaf``; for collisions
``witness``.  *Untrusted*, may only propose: ``gjk`` and the search in ``deepest``.

Shared conventions: a pose is 12 numbers, the rows of a 3x4 matrix ``[R | t]``; ``tau`` runs over
[-1, 1] on a piece; a *node* is a movable joint, its frame moves with the joint and has the joint
axis as z.
"""
