"""Meshes that are not convex, as files; and a gantry that carries a link through them."""

import numpy as np

from trajectory_guard.cell.scene import load_scene
from trajectory_guard.cell.urdf import robot_from_urdf
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.paths.trajectory import Point, Trajectory
from trajectory_guard.shapes.mesh_formats import Triangles

SECOND = 1_000_000_000

# Counter-clockwise outlines [m].
U = [(-2, -2), (2, -2), (2, 2), (1, 2), (1, -1), (-1, -1), (-1, 2), (-2, 2)]
L = [(0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3)]

GANTRY = """
<robot name="gantry">
  <link name="base"/><link name="x"/><link name="y"/><link name="z"/>
  <link name="tool"><collision><geometry>{tool}</geometry></collision></link>
  {slides}
  <joint name="jr" type="continuous">
    <parent link="z"/><child link="tool"/><axis xyz="0 0 1"/>
  </joint>
</robot>
"""
SLIDE = """<joint name="j{c}" type="prismatic"><parent link="{p}"/><child link="{c}"/>
  <axis xyz="{a}"/><limit lower="-20" upper="20" effort="1" velocity="1"/></joint>"""


def extruded(outline, height=1.0, scale=0.1):
    """Return a closed prism over a simple polygon, from -height/2 to height/2 [m]."""
    flat = np.array(outline, float)
    n = len(flat)
    points = np.vstack([np.column_stack([flat, np.full(n, z)]) for z in (-height / 2, height / 2)])
    sides = [(k, (k + 1) % n) for k in range(n)]
    walls = [t for a, b in sides for t in ((a, b, n + b), (a, n + b, n + a))]
    cap = _ears(flat)
    caps = [(c, b, a) for a, b, c in cap] + [(n + a, n + b, n + c) for a, b, c in cap]
    return Triangles(points * scale, np.array(walls + caps))


def _ears(flat):
    """Return the triangles of a simple polygon."""
    left = list(range(len(flat)))
    found = []
    while len(left) > 3:
        for k in range(len(left)):
            a, b, c = left[k - 1], left[k], left[(k + 1) % len(left)]
            others = [flat[i] for i in left if i not in (a, b, c)]
            if _turn(flat[a], flat[b], flat[c]) > 0 and not any(
                all(_turn(*side, x) >= 0 for side in _sides(flat[a], flat[b], flat[c]))
                for x in others
            ):
                found.append((a, b, c))
                left.remove(b)
                break
    return [*found, tuple(left)]


def _sides(a, b, c):
    return (a, b), (b, c), (c, a)


def _turn(a, b, c):
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def ring(major=0.2, minor=0.05, around=48, across=24):
    """Return a closed torus about z [m]."""
    u, v = np.meshgrid(np.arange(around), np.arange(across), indexing='ij')
    a, b = 2 * np.pi * u / around, 2 * np.pi * v / across
    r = major + minor * np.cos(b)
    points = np.stack([r * np.cos(a), r * np.sin(a), minor * np.sin(b)], axis=-1).reshape(-1, 3)

    def at(i, j):
        return (i % around * across + j % across).ravel()

    p, q, s, t = at(u, v), at(u + 1, v), at(u + 1, v + 1), at(u, v + 1)
    return Triangles(points, np.concatenate([np.stack((p, q, s), 1), np.stack((p, s, t), 1)]))


def box(low, high, inward=False):
    """Return a closed box; its triangles look inward if asked."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    points = np.asarray(low) + corners * (np.asarray(high) - np.asarray(low))
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])
    return Triangles(points, triangles[:, ::-1] if inward else triangles)


def joined(*meshes):
    """Return several meshes as one."""
    starts = np.cumsum([0, *(len(mesh.points) for mesh in meshes)])
    return Triangles(
        np.concatenate([mesh.points for mesh in meshes]),
        np.concatenate([m.triangles + s for m, s in zip(meshes, starts, strict=False)]),
    )


def without(mesh, *faces):
    """Return a mesh without some of its triangles."""
    return Triangles(mesh.points, np.delete(mesh.triangles, faces, axis=0))


def write(mesh, path):
    """Write a mesh as a binary STL file; returns the path."""
    rows = np.zeros(
        len(mesh.triangles), [('normal', '<f4', 3), ('v', '<f4', (3, 3)), ('a', '<u2')]
    )
    rows['v'] = mesh.points[mesh.triangles]
    path.write_bytes(bytes(80) + np.uint32(len(rows)).tobytes() + rows.tobytes())
    return path


def gantry(tool):
    """Return a robot that slides a tool along x, y, z and turns it about z."""
    slides = ''.join(
        SLIDE.format(p=p, c=c, a=a)
        for p, c, a in (('base', 'x', '1 0 0'), ('x', 'y', '0 1 0'), ('y', 'z', '0 0 1'))
    )
    return robot_from_urdf(GANTRY.format(tool=tool, slides=slides))


def box_tool(x, y, z):
    """Return the geometry of a box tool [m]."""
    return f'<box size="{x} {y} {z}"/>'


def mesh_tool(path):
    """Return the geometry of a mesh tool."""
    return f'<mesh filename="{path}"/>'


def cell(tool, mesh, folder, name='bin'):
    """Return a workcell of the gantry with a tool, and one mesh file as the scene."""
    return Workcell(gantry(tool), load_scene(write(mesh, folder / f'{name}.stl')))


def move(*places):
    """Return a trajectory through places (x, y, z, turn), a second each, at rest in each."""
    rest = [0.0] * 4
    return Trajectory.from_points(
        ['jx', 'jy', 'jz', 'jr'],
        [Point(k * SECOND, [*place, *rest[len(place) :]], rest) for k, place in enumerate(places)],
    )
