"""
The certifier's inner loops, in C++: plain structures of arrays in, leaves and entries out.

Layer contract.  A kernel takes arrays that the core has validated (finite, contiguous, of the
shapes that ``layout`` names), keeps no pointer beyond the call and raises nothing; it runs without
the interpreter's lock, and the same question has the same answer to the bit on any thread and on
any processor.  Arithmetic is IEEE double without contraction and without any fast-math flag, so
NaN and infinity propagate, and every comparison that certifies is written so that NaN fails it.

*Trusted* (a wrong line here could call a collision free): the motion in ``piece.hpp``,
``economised.hpp``, ``rational.hpp`` and ``motion.hpp``; lever arms in ``reach.hpp``; the
inequalities in ``separation.hpp`` and ``cull.hpp``; rounding in ``margin.hpp``; the books in
``cover.hpp``, ``pair.hpp`` and ``leaf.hpp``; for collisions ``witness.hpp``, ``contact.hpp`` and
the depths of ``deepest.hpp``; for pairs that were taken apart the core's ``parts.py``,
``enclosed.py`` and ``containment.py``.  *Untrusted*, may only propose: ``gjk.hpp`` and the search
in ``deepest.hpp``.

A unit of its own, ``ball.cpp``, covers free rational motions of polyhedra by balls; of it
``ball_cover.hpp``, ``ball.hpp``, ``cluster.hpp``, ``fat_polygon.hpp`` and ``quadratic.hpp`` are
trusted, but for the guess whether two polygons cross.

``canny.cpp`` is a unit of its own, the algebraic collision test.  *Trusted*: ``bernstein.hpp``,
``signs.hpp``, ``spans.hpp``, ``constraints.hpp``, ``meeting.hpp``, ``linear.hpp``; ``cubic.hpp``
may only propose.

Shared conventions: ``tau`` runs over [-1, 1] on a piece; a *node* is a movable joint, its frame
moves with the joint and has the joint axis as z.
"""
