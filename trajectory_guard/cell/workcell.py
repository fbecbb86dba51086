"""A robot and its scene together, packed once for every request."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from trajectory_guard.cell.detail import Detail
from trajectory_guard.cell.pack import boxes, perpendicular, solids
from trajectory_guard.cell.robot import Robot
from trajectory_guard.cell.scene import Scene
from trajectory_guard.cell.tree import Tree, tree
from trajectory_guard.errors import Reason, RobotError, SceneError
from trajectory_guard.kernels.layout import Extents, FAR, NODE, Packed, Path, Solids, UP
from trajectory_guard.kernels.touching import touching
from trajectory_guard.shapes.body import ConvexBody

if TYPE_CHECKING:
    from trajectory_guard.ball_cover import BallCell

# Sets of commanded joints whose pairs are kept; clients choose them, so their number is bounded.
MOST_KEPT = 64

# The centre of a part is a mean of up to 2^24 points or so, and rounds by as many units.
MEAN = 1.0 + 2.0**-26


@dataclass(frozen=True, slots=True, eq=False)
class Pairs:
    """
    Which bodies a set of commanded joints moves against which obstacles.

    :param moving: (M,) int64: packed bodies to check against every obstacle.
    :param still: (Q, 2) int64: body and obstacle of the pairs that stand where joints hold them.
    :param touching: names of the pairs that no joint at all moves and that touch.
    :param count: number of pairs of a link and an obstacle among the first.
    :param unchecked: what is left out, in words.
    """

    moving: np.ndarray
    still: np.ndarray
    touching: frozenset[tuple[str, str]]
    count: int
    unchecked: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Workcell:
    """
    Everything about robot and scene that does not depend on the trajectory.

    :param robot: the robot.
    :param scene: obstacles in the robot's root frame.
    :raises RobotError: the robot has no collision geometry, or a mesh of it is unusable.
    :raises SceneError: the scene has no obstacle.
    """

    robot: Robot
    scene: Scene
    robot_hash: str = field(init=False)
    scene_hash: str = field(init=False)
    tree: Tree = field(init=False)
    links: Solids = field(init=False)
    obstacles: Solids = field(init=False)
    link_names: tuple[str, ...] = field(init=False)
    obstacle_names: tuple[str, ...] = field(init=False)
    link_nodes: np.ndarray = field(init=False)
    packed: Packed = field(init=False, repr=False)
    detail: Detail = field(init=False, repr=False)
    bodies: tuple[tuple[ConvexBody, ...], tuple[ConvexBody, ...]] = field(init=False, repr=False)
    _pairs: dict[bytes, Pairs] = field(init=False, repr=False, default_factory=dict)
    _ball_cells: 'list[BallCell]' = field(init=False, repr=False, default_factory=list)

    def __post_init__(self) -> None:
        """Load the geometry and pack it."""

        def keep(name: str, value: object) -> None:
            object.__setattr__(self, name, value)

        folded = tree(self.robot)
        names: list[str] = []
        bodies = []
        for link in self.robot.collision_links:
            for body in self.robot.bodies(link):
                names.append(link)
                bodies.append(body.moved(folded.link_pose[link]))
        if not bodies:
            raise RobotError(
                Reason.ROBOT_EMPTY, f'robot {self.robot.name!r} has no collision geometry'
            )
        obstacle_names = [o.name for o in self.scene.obstacles for _ in o.bodies]
        if not obstacle_names:
            raise SceneError(Reason.SCENE_EMPTY, 'the scene has no obstacle')
        targets = [b for o in self.scene.obstacles for b in o.bodies]
        keep('bodies', (tuple(bodies), tuple(targets)))
        keep('tree', folded)
        keep('links', solids(bodies, [folded.link_node[name] for name in names]))
        keep('obstacles', solids(targets, [-1] * len(targets)))
        keep('link_names', tuple(names))
        keep('obstacle_names', tuple(obstacle_names))
        keep('link_nodes', self.links.ranges[:, NODE].copy())
        # The culls move a body's centre, which may lie farther out than its vertices.
        out = np.array([np.linalg.norm(body.center) for body in bodies]) * UP
        # A surface lies in its body, ball included, and its points off it by no more than that.
        beyond = np.array([body.ball if body.surface else 0.0 for body in bodies])
        up = np.array([MEAN if body.surface else 1.0 for body in bodies])
        across = np.array([perpendicular(body) for body in bodies])
        extents = Extents(
            extent=(np.maximum(self.links.size[:, FAR], out) + beyond) * up,
            perpendicular=(across + 2 * beyond) * up,
            offsets=np.array([folded.link_path[name] for name in names]),
        )
        detail = Detail(
            folded.chain,
            boxes(self.obstacles),
            extents,
            (self.links, self.obstacles),
            ([body.surface for body in bodies], [body.surface for body in targets]),
        )
        keep('detail', detail)
        keep('packed', detail.level.packed)
        keep('robot_hash', self.robot.digest())
        keep('scene_hash', self.scene.digest)

    @property
    def ball_cell(self) -> 'BallCell':
        """The bodies as polyhedra, made when first asked for."""
        # Brings scipy.
        from trajectory_guard.ball_cover import BallCell

        if not self._ball_cells:
            # Two threads may both make one; either will do.
            self._ball_cells.append(BallCell(*self.bodies))
        return self._ball_cells[0]

    @property
    def refinable(self) -> frozenset[str]:
        """Names of the links and obstacles with meshes that are less than their hulls."""
        sides = zip(self.detail.surfaces, (self.link_names, self.obstacle_names), strict=True)
        return frozenset(
            name
            for surfaces, names in sides
            for surface, name in zip(surfaces, names, strict=True)
            if surface
        )

    def pairs(self, in_path: np.ndarray) -> Pairs:
        """
        Return the pairs for a set of commanded joints.

        :param in_path: (n,) bool per node.
        :raises RobotError: the joints move no link with collision geometry.
        """
        key = in_path.tobytes()
        pairs = self._pairs.get(key)
        if pairs is None:
            pairs = self._pair_up(in_path)
            if len(self._pairs) < MOST_KEPT:
                self._pairs[key] = pairs
        return pairs

    def touching(self, pairs: np.ndarray, path: Path) -> frozenset[tuple[str, str]]:
        """
        Return the names of the pairs that touch at a path's first instant.

        :param pairs: (Q, 2) int64: body and obstacle.
        :param path: the joint path.
        """
        if not len(pairs):
            return frozenset()
        touch = touching(self.packed, path, pairs)
        return frozenset(
            (self.link_names[b], self.obstacle_names[o]) for b, o in pairs[touch].tolist()
        )

    def _pair_up(self, in_path: np.ndarray) -> Pairs:
        moved = np.zeros(len(in_path), bool)
        for j, parent in enumerate(self.tree.chain.parent):
            moved[j] = in_path[j] or (parent >= 0 and moved[parent])
        body_moved = np.array([node >= 0 and moved[node] for node in self.link_nodes])
        if not body_moved.any():
            raise RobotError(
                Reason.ROBOT_EMPTY,
                'no joint of the trajectory moves a link with collision geometry',
            )
        moving = np.flatnonzero(body_moved)
        still = np.flatnonzero(~body_moved)
        moving_links = {self.link_names[b] for b in moving}
        still_links = sorted({self.link_names[b] for b in still})
        unchecked = []
        if len(set(self.link_names)) > 1:
            unchecked.append('links of the robot against each other')
        unchecked += [f'{link} against the scene: no joint moves it' for link in still_links]
        return Pairs(
            moving=moving,
            still=_product(still[self.link_nodes[still] >= 0], len(self.obstacle_names)),
            touching=self.touching(
                _product(still[self.link_nodes[still] < 0], len(self.obstacle_names)),
                _standing(len(in_path)),
            ),
            count=len(moving_links) * len(self.scene.obstacles),
            unchecked=tuple(unchecked),
        )


def _standing(joints: int) -> Path:
    """Return a path on which nothing moves."""
    return Path(np.zeros((1, joints, 6)), np.zeros((1, joints)), np.zeros(joints))


def _product(bodies: np.ndarray, obstacles: int) -> np.ndarray:
    """Return every pair of one of the bodies and an obstacle, (P, 2) int64."""
    return np.column_stack(
        [np.repeat(bodies, obstacles), np.tile(np.arange(obstacles), len(bodies))]
    ).astype(np.int64)
