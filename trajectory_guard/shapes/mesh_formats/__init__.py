"""
Strict readers of mesh files: bytes in, triangles out, nothing dropped.

The usual loaders are made for pictures: they skip what they cannot read and round to single
precision. A guard that skips a triangle certifies a hole, so here every byte is accounted for and
a reader either returns the whole surface or raises ValueError.
"""

from collections.abc import Callable

from trajectory_guard.shapes.mesh_formats.collada import read_collada
from trajectory_guard.shapes.mesh_formats.obj import read_obj
from trajectory_guard.shapes.mesh_formats.ply import read_ply
from trajectory_guard.shapes.mesh_formats.stl import read_stl
from trajectory_guard.shapes.mesh_formats.triangles import Triangles

READERS: dict[str, Callable[[bytes], Triangles]] = {
    '.stl': read_stl,
    '.obj': read_obj,
    '.dae': read_collada,
    '.ply': read_ply,
}

__all__ = ['READERS', 'Triangles', 'read_collada', 'read_obj', 'read_ply', 'read_stl']
