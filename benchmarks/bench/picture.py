"""Bodies in parallel projection as an SVG."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from trajectory_guard.canny import ConvexPolyhedron

# The view: right, up and towards the eye, as rows.
_EYE = np.array([0.45, 0.65, 0.61]) / np.linalg.norm([0.45, 0.65, 0.61])
VIEW = np.array([np.cross([0.0, 0.0, 1.0], _EYE), [0.0, 0.0, 0.0], _EYE])
VIEW[0] /= np.linalg.norm(VIEW[0])
VIEW[1] = np.cross(_EYE, VIEW[0])

SCALE = 60.0  # pixels a metre
MARGIN = 30.0


@dataclass(frozen=True)
class Drawn:
    """
    A body in a place and a colour.

    :param body: a convex part.
    :param pose: (3, 4).
    :param colour: of its faces.
    :param opacity: of its faces.
    :param layer: what has a higher one is drawn over it, wherever it is.
    """

    body: ConvexPolyhedron
    pose: np.ndarray
    colour: str
    opacity: float = 1.0
    layer: int = 1


def draw(
    path: Path, bodies: Iterable[Drawn], points: Sequence[tuple[Sequence[float], str]]
) -> None:
    """
    Write a picture.

    :param path: of the file.
    :param bodies: what to draw; faces that look away are left out, near ones hide far ones.
    :param points: places with labels, drawn over everything [m].
    """
    faces = sorted((face for one in bodies for face in _faces(one)), key=lambda face: face[0])
    marks = [(VIEW @ np.asarray(place), label) for place, label in points]
    corners = np.concatenate([shape for _, shape, _ in faces])
    low, high = corners.min(axis=0), corners.max(axis=0)
    width, height = SCALE * (high - low) + 2 * MARGIN

    def at(x: np.ndarray) -> tuple[float, float]:
        return MARGIN + SCALE * (x[0] - low[0]), MARGIN + SCALE * (high[1] - x[1])

    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}" '
        'font-family="sans-serif" font-size="14">'
    )
    lines = [head, '<rect width="100%" height="100%" fill="white"/>']
    for _, shape, style in faces:
        corners_text = ' '.join(f'{u:.1f},{v:.1f}' for u, v in map(at, shape))
        lines.append(f'<polygon points="{corners_text}" {style}/>')
    for place, label in marks:
        u, v = at(place)
        lines.append(f'<circle cx="{u:.1f}" cy="{v:.1f}" r="4" fill="#c00"/>')
        lines.append(f'<text x="{u + 6:.1f}" y="{v - 6:.1f}">{label}</text>')
    path.write_text('\n'.join([*lines, '</svg>', '']), encoding='utf-8')


def _faces(one: Drawn) -> Iterable[tuple[tuple[int, float], np.ndarray, str]]:
    """Yield layer and depth, projected corners and style of the faces that look at the eye."""
    seen = (one.body.vertices @ one.pose[:, :3].T + one.pose[:, 3]) @ VIEW.T
    style = (
        f'fill="{one.colour}" fill-opacity="{one.opacity}" stroke="#333" stroke-width="0.8" '
        'stroke-linejoin="round"'
    )
    for face in one.body.faces:
        corners = seen[list(face)]
        a, b, c = corners[:3]
        if np.cross(b - a, c - a)[2] > 0.0:
            yield (one.layer, float(corners[:, 2].mean())), corners[:, :2], style
