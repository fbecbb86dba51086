"""The orbit of a polygon: balls, hyperboloids of revolution and one of two sheets."""

from dataclasses import dataclass, field

import numpy as np

from trajectory_guard.toleranced.contact import apart
from trajectory_guard.toleranced.displacement_ball import DisplacementBall, Orbit
from trajectory_guard.toleranced.distance import largest_accepted
from trajectory_guard.toleranced.fat_edge import distance_guess, FatEdge
from trajectory_guard.toleranced.fat_point import FatPoint, feature
from trajectory_guard.toleranced.patches import (
    circle,
    grid,
    joined,
    lune,
    Mesh,
    Patch,
    triangle_grid,
)
from trajectory_guard.toleranced.plane_metric import PlaneMetric
from trajectory_guard.toleranced.polygon import Polygon


@dataclass(frozen=True, slots=True, eq=False)
class FatPolygon:
    """
    The orbit of a polygon, convex or not, under a ball of displacements [SW, sec. 3].

    :param ball: the displacements.
    :param polygon: in the body's frame.
    :param orbits: of its triangles.
    """

    ball: DisplacementBall
    polygon: Polygon
    orbits: tuple[Orbit, ...] = field(init=False)

    def __post_init__(self) -> None:
        """Map the triangles."""
        orbits = tuple(self.ball.orbit(corners) for corners in self.polygon.corners)
        object.__setattr__(self, 'orbits', orbits)

    @property
    def plane(self) -> PlaneMetric:
        """Metric data of the polygon's plane."""
        return PlaneMetric.of(self.ball, self.polygon.vertices[0], self.polygon.normal)

    @property
    def points(self) -> tuple[FatPoint, ...]:
        """Orbits of the vertices."""
        return tuple(FatPoint(self.ball, vertex) for vertex in self.polygon.vertices)

    @property
    def edges(self) -> tuple[FatEdge, ...]:
        """Orbits of the edges."""
        return tuple(FatEdge(self.ball, ends) for ends in self.polygon.edges)

    def apart(self, p: np.ndarray, thickness: float = 0.0) -> bool:
        """
        Say whether a point is proved to be farther than a thickness from the orbit.

        :param p: fixed, (3,) in the world frame [m].
        :param thickness: >= 0 [m].
        """
        p = feature(p, (3,), 'p')
        return all(apart(p[None], orbit, thickness) for orbit in self.orbits)

    def contains(self, p: np.ndarray) -> bool:
        """Say whether a point may lie in the orbit: False is proved. (3,) [m]."""
        return not self.apart(p)

    def distance_bound(self, p: np.ndarray) -> float:
        """
        Return a lower bound of a point's distance to the orbit [m].

        Nearly exact near the orbit; farther off it may lack a part of how R rho differs along the
        feature.

        :param p: (3,) in the world frame [m].
        """
        p = feature(p, (3,), 'p')
        guess = distance_guess(self.ball, self.polygon.vertices, p)
        return largest_accepted(lambda d: self.apart(p, d), guess)

    def boundary_mesh(self, steps: int = 8) -> Mesh:
        """
        Return the boundary, or surfaces whose outer parts are the boundary.

        For a convex polygon and R < min(nu_1, nu_2) the patches fit together; the edges' patches
        at a reflex corner run on inside the orbit. For larger R the face has no patch (Remark 1),
        and the orbits of all edges are drawn whole.

        :param steps: parts of an edge, and of a quarter circle.
        :raises RequestError: INVALID_PARAMETER, g flattens the polygon.
        """
        plane, R = self.plane, self.ball.radius
        if not plane.nu.min() > R:
            return joined([edge.boundary_mesh(steps) for edge in self.edges])
        corners = self.ball.images(self.polygon.vertices)
        # Seen from the tip of this normal the image turns left, also if g mirrors.
        away = corners - corners[0]
        turn = np.cross(away, np.roll(away, -1, axis=0)).sum(axis=0)
        normal = plane.axes[:, 2] * np.sign(turn @ plane.axes[:, 2])
        side = float(np.sign(normal @ plane.axes[:, 2]))
        bands = [
            self._band(plane, FatEdge(self.ball, ends), normal, steps)
            for ends in self.polygon.edges
        ]
        patches = [grid(band, Patch.EDGE) for band in bands]
        for triangle in self.ball.images(self.polygon.corners):
            flat = triangle_grid(triangle, steps, Patch.FACE)
            over, under = (plane.project(R, flat.vertices, s * side) for s in (1.0, -1.0))
            patches.append(flat._replace(vertices=over))
            patches.append(flat._replace(vertices=under, triangles=flat.triangles[:, ::-1]))
        sides = np.roll(corners, -1, axis=0) - corners
        for k, corner in enumerate(corners):
            if np.cross(sides[k - 1], sides[k]) @ normal > 0.0:
                patches.append(lune(bands[k - 1][-1], bands[k][0], corner, steps))
        return joined(patches)

    def _band(
        self, plane: PlaneMetric, edge: FatEdge, normal: np.ndarray, steps: int
    ) -> np.ndarray:
        """
        Return points of an edge's patch, (steps + 1, 4 steps + 1, 3) [m].

        It lies between the sheets' patches, whose normals over the edge have the part -r_m along
        the outward normal m of the edge: cos(phi_0) = -r_m / sqrt(1 - r'^2), |phi| <= phi_0.
        """
        R, line = self.ball.radius, edge.line
        ends = self.ball.images(edge.ends)
        first, last = (ends - line.foot) @ line.direction
        t = np.linspace(first, last, steps + 1)
        outward = np.cross(line.direction, normal)
        slope = plane.slope(R, line.foot + t[:, None] * line.direction)
        cosine = -(slope @ outward) / np.sqrt(1.0 - (slope @ line.direction) ** 2)
        widest = np.arccos(np.clip(cosine, -1.0, 1.0))
        angles = widest[:, None] * np.linspace(-1.0, 1.0, 4 * steps + 1)
        return circle(line, R, t, np.column_stack((outward, normal)), angles)
