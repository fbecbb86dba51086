"""
Exact contact times of moving polyhedra: the algebraic predicates of [Canny 1984].

A body is a union of convex polyhedra, a path a polynomial position and a polynomial quaternion of
any length over s in [0, 1]. Every contact between features is then the sign of one polynomial in
s, and overlap a disjunction of conjunctions of signs.

*Exact*: :func:`overlaps` (one mover or two), :func:`pairwise` (several). All numbers given are
taken as exact, all answers are proved, ends of overlaps come with enclosures and contacts.
*Rounded, with bounds*: :func:`fast_overlap`, microseconds a pair; its *possible* spans contain
every overlap and its *certain* ones nothing else. :func:`linear_contacts` and
:func:`linear_answers` are the same for four points on straight lines. :func:`along` gives a
single constraint along a robot link's rational motion.

Quaternions are (q0, q1, q2, q3), scalar first, of any length but 0: the rotation by
2 atan2(|q|, q0) about q. Lengths are metres. Bodies are closed: touching is overlap.
"""

from trajectory_guard.canny.along import Along, along
from trajectory_guard.canny.constraint import Kind
from trajectory_guard.canny.contact import Contact
from trajectory_guard.canny.fast import fast_overlap, FastOverlap
from trajectory_guard.canny.linear import Answer, linear_answers, linear_contacts, LinearKind
from trajectory_guard.canny.moment import Moment
from trajectory_guard.canny.motion import Configuration, Motion, recentred, still, straight
from trajectory_guard.canny.overlap import Mover, Overlap, overlaps, pairwise
from trajectory_guard.canny.polyhedron import ConvexPolyhedron

__all__ = [
    'Along',
    'Answer',
    'Configuration',
    'Contact',
    'ConvexPolyhedron',
    'FastOverlap',
    'Kind',
    'LinearKind',
    'Moment',
    'Motion',
    'Mover',
    'Overlap',
    'along',
    'fast_overlap',
    'linear_answers',
    'linear_contacts',
    'overlaps',
    'pairwise',
    'recentred',
    'still',
    'straight',
]
