"""An outside judge: coal's distance between convex bodies at one configuration."""

import coal
import numpy as np
from random_robot import link_poses
from scipy.spatial import ConvexHull


class Judge:
    """Signed distances of a workcell's links and obstacles at sampled configurations."""

    def __init__(self, cell):
        self.robot = cell.robot
        self.links = [
            (link, shape(body))
            for link in cell.robot.collision_links
            for body in cell.robot.bodies(link)
        ]
        self.obstacles = [
            (obstacle.name, shape(body))
            for obstacle in cell.scene.obstacles
            for body in obstacle.bodies
        ]
        self.request = coal.DistanceRequest()
        self.request.gjk_tolerance = 1e-10

    def clearance(self, q, links=None):
        """
        Return the smallest distance over the pairs [m], negative when something overlaps.

        :param q: (n,) movable joints.
        :param links: names of the links that count; all if None.
        """
        T = link_poses(self.robot, q)
        best = np.inf
        for link, (first, shift, ball) in self.links:
            if links is not None and link not in links:
                continue
            pose = T[link] @ shift
            placed = coal.Transform3s(pose[:3, :3], pose[:3, 3])
            for _, (second, other, margin) in self.obstacles:
                fixed = coal.Transform3s(other[:3, :3], other[:3, 3])
                d = coal.distance(
                    first, placed, second, fixed, self.request, coal.DistanceResult()
                )
                best = min(best, d - ball - margin)
        return best


def shape(body):
    """Return coal's shape of a convex body, its pose, and a radius to take off the distance."""
    if body.disc_radius:
        a, b = body.vertices
        z = (b - a) / np.linalg.norm(b - a)
        x = np.cross(z, [1.0, 0.0, 0.0] if abs(z[0]) < 0.9 else [0.0, 1.0, 0.0])
        x /= np.linalg.norm(x)
        T = np.eye(4)
        T[:3, :3] = np.column_stack([x, np.cross(z, x), z])
        T[:3, 3] = 0.5 * (a + b)
        return coal.Cylinder(body.disc_radius, np.linalg.norm(b - a)), T, body.ball
    if len(body.vertices) == 1:
        T = np.eye(4)
        T[:3, 3] = body.vertices[0]
        return coal.Sphere(body.ball), T, 0.0
    vertices = coal.StdVec_Vec3s()
    for v in body.vertices:
        vertices.append(v)
    triangles = coal.StdVec_Triangle()
    for t in ConvexHull(body.vertices).simplices:
        triangles.append(coal.Triangle(*map(int, t)))
    return coal.Convex(vertices, triangles), np.eye(4), body.ball
