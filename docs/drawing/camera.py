"""An orthographic camera, and what it draws: shaded surfaces and curves."""

from collections.abc import Sequence
from dataclasses import dataclass
import math

from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_rgb
import numpy as np

from trajectory_guard.toleranced.patches import Mesh

# What a surface keeps of its colour where no light falls on it.
AMBIENT = 0.5

# Where the light comes from: right, up and towards the eye.
LIGHT = np.array([-0.4, 0.6, 0.7]) / math.sqrt(1.01)


@dataclass(frozen=True, slots=True)
class Camera:
    """
    A view from far away; up is z.

    :param azimuth: where the eye stands, counter-clockwise from x [rad].
    :param elevation: how high it stands [rad].
    """

    azimuth: float
    elevation: float

    @property
    def axes(self) -> np.ndarray:
        """Unit vectors right, up and towards the eye as columns, (3, 3)."""
        (c, s), (d, h) = (
            (math.cos(angle), math.sin(angle)) for angle in (self.azimuth, self.elevation)
        )
        return np.array([[-s, -c * h, c * d], [c, -s * h, s * d], [0.0, d, h]])

    def flat(self, points: np.ndarray) -> np.ndarray:
        """Return points as seen, (..., 3) to (..., 2) [m]."""
        seen: np.ndarray = points @ self.axes[:, :2]
        return seen

    def surface(self, axes: Axes, mesh: Mesh, colours: Sequence[str]) -> None:
        """
        Draw what is seen of a closed surface, what is behind first.

        :param axes: where.
        :param mesh: the surface.
        :param colours: by label.
        """
        seen = np.flatnonzero(self.faces_eye(mesh))
        nearness = mesh.vertices[mesh.triangles[seen]].mean(axis=1) @ self.axes[:, 2]
        seen = seen[np.argsort(nearness)]
        corners = mesh.vertices[mesh.triangles[seen]]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        bright = AMBIENT + (1.0 - AMBIENT) * np.maximum(normals @ self.axes @ LIGHT, 0.0)
        paint = np.array([to_rgb(colour) for colour in colours])[mesh.labels[seen]]
        shaded = paint * bright[:, None]
        # Edges of the same colour hide the seams between triangles.
        axes.add_collection(
            PolyCollection(
                list(self.flat(corners)),
                facecolors=shaded,
                edgecolors=shaded,
                linewidths=0.4,
            )
        )

    def faces_eye(self, mesh: Mesh) -> np.ndarray:
        """Say which triangles are turned to the eye, (m,) bool."""
        corners = self.flat(mesh.vertices[mesh.triangles])
        (ax, ay), (bx, by) = (corners[:, 1] - corners[:, 0]).T, (corners[:, 2] - corners[:, 0]).T
        turned: np.ndarray = ax * by - ay * bx > 0.0
        return turned

    def lines(
        self, axes: Axes, segments: np.ndarray, colour: str, width: float, style: str = 'solid'
    ) -> None:
        """
        Draw segments.

        :param axes: where.
        :param segments: (n, 2, 3) or (n, k, 3) for polylines [m].
        :param colour: of all.
        :param width: [pt].
        :param style: as matplotlib names it.
        """
        axes.add_collection(
            LineCollection(
                list(self.flat(segments)),
                colors=colour,
                linewidths=width,
                linestyles=style,
                capstyle='round' if style == 'solid' else 'butt',
                joinstyle='round',
            )
        )
