"""What the parameters of the guard say, checked as a whole."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import math
import os
from pathlib import Path
from typing import Any

import numpy as np
from rclpy.service_introspection import ServiceIntrospectionState

from trajectory_guard.cell.pose import pose_matrix
from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.markers.marker_scene import MarkerLimits
from trajectory_guard.result import NANOSECONDS
from trajectory_guard.ros.declared import names_in, per_joint
from trajectory_guard.settings import Cover, Settings
from trajectory_guard.shapes.resource import MeshLimits

INTROSPECTION = {
    'off': ServiceIntrospectionState.OFF,
    'metadata': ServiceIntrospectionState.METADATA,
    'contents': ServiceIntrospectionState.CONTENTS,
}


@dataclass(frozen=True, slots=True)
class Configuration:
    """
    One consistent set of the guard's parameters.

    :param robot_description_file: URDF of the robot; '': it comes from the topic.
    :param robot_description_topic: latched std_msgs/String with the URDF.
    :param scene_files: URDF and mesh files of the scene.
    :param scene_pose: x, y, z, roll, pitch, yaw of the files' frame in the robot's root link
        [m, rad], as URDF writes an origin.
    :param settings: what holds for a request that asks for nothing else; its clearance and its
        tracking tolerance are the least that a request may ask for.
    :param tracking_tolerance_joints: the joints that the values of the tracking tolerance belong
        to; empty: there is one value, for all joints.
    :param max_points: points that a trajectory may have.
    :param max_joints: joints that a trajectory or a start state may have.
    :param autostart: configure and activate without a manager.
    :param live_scene: whether markers are part of the scene.
    :param scene_topic: latched visualization_msgs/MarkerArray.
    :param max_scene_age: age of the last markers up to which requests are answered [s]; 0: any.
    :param joint_states_topic: sensor_msgs/JointState; '': not used.
    :param max_state_age: up to which a joint state is fresh [s].
    :param max_requests: requests that may be in flight.
    :param marker_limits: how much the live scene may hold.
    :param mesh_limits: which mesh files may be read.
    :param introspection: what `~/certify/_service_event` tells.
    :raises RequestError: naming the parameter and its value.
    """

    robot_description_file: str
    robot_description_topic: str
    scene_files: tuple[str, ...]
    scene_pose: tuple[float, ...]
    settings: Settings
    tracking_tolerance_joints: tuple[str, ...]
    max_points: int
    max_joints: int
    autostart: bool
    live_scene: bool
    scene_topic: str
    max_scene_age: float
    joint_states_topic: str
    max_state_age: float
    max_requests: int
    marker_limits: MarkerLimits
    mesh_limits: MeshLimits
    introspection: ServiceIntrospectionState

    def __post_init__(self) -> None:
        """Refuse what does not fit together; settings and ranges have been checked before."""
        if len(self.scene_pose) != 6 or not all(map(math.isfinite, self.scene_pose)):
            raise RequestError(
                Reason.INVALID_PARAMETER,
                'scene_pose must be six finite numbers x, y, z, roll, pitch, yaw, '
                f'got {list(self.scene_pose)}',
            )
        joints, values = self.tracking_tolerance_joints, self.settings.tracking_tolerance
        if len(set(joints)) != len(joints):
            raise RequestError(
                Reason.DUPLICATE_JOINT,
                f'tracking_tolerance_joints names a joint twice: {list(joints)}',
            )
        if len(values) != (len(joints) or 1):
            raise RequestError(
                Reason.INVALID_TRACKING_TOLERANCE,
                'tracking_tolerance must be one value, or one for each of '
                f'tracking_tolerance_joints, got {list(values)} for {list(joints)}',
            )

    @classmethod
    def from_values(cls, values: Mapping[str, Any]) -> 'Configuration':
        """
        Build a configuration from the values of all parameters.

        :param values: parameter values by name, each within its declared range; None is an empty
            list, as YAML gives it.
        :raises RequestError: as the class does, and what the settings refuse.
        """
        return cls(
            robot_description_file=values['robot_description_file'],
            robot_description_topic=values['robot_description_topic'],
            scene_files=names_in(values['scene_files']),
            scene_pose=tuple(values['scene_pose'] or ()),
            settings=Settings(
                tolerance=values['tolerance'],
                clearance=values['clearance'],
                tracking_tolerance=tuple(values['tracking_tolerance'] or ()),
                deadline_ns=round(values['deadline'] * NANOSECONDS),
                max_pieces=values['max_pieces'],
                cover=Cover.named(values['cover']),
                refine=values['refine'],
                allowed_start_tolerance=values['allowed_start_tolerance'],
                joint_limit_tolerance=values['joint_limit_tolerance'],
                check_joint_limits=values['check_joint_limits'],
                allow_nonzero_end_velocity=values['allow_nonzero_end_velocity'],
            ),
            tracking_tolerance_joints=names_in(values['tracking_tolerance_joints']),
            max_points=values['max_points'],
            max_joints=values['max_joints'],
            autostart=values['autostart'],
            live_scene=values['live_scene'],
            scene_topic=values['scene_topic'],
            max_scene_age=values['max_scene_age'],
            joint_states_topic=values['joint_states_topic'],
            max_state_age=values['max_state_age'],
            max_requests=values['max_requests'] or 2 * (os.cpu_count() or 1),
            marker_limits=MarkerLimits(
                markers=values['max_markers'],
                mesh_bytes=values['max_mesh_bytes'],
                mesh_roots=_folders(values['mesh_roots']),
            ),
            mesh_limits=MeshLimits(_folders(values['mesh_roots']), values['max_mesh_bytes']),
            introspection=_introspection(values['introspection']),
        )

    @property
    def T_root_scene(self) -> np.ndarray:
        """Pose of the scene files' frame in the robot's root link, (4, 4) [m]."""
        return pose_matrix(self.scene_pose[:3], self.scene_pose[3:])

    def least_tracking_tolerance(self, joint_names: Sequence[str]) -> tuple[float, ...]:
        """
        Return the tracking tolerance that a trajectory is certified with at least.

        :param joint_names: joints of the trajectory, in its order.
        :returns: one value per joint [rad or m].
        :raises RequestError: the parameter has no value for one of them.
        """
        return per_joint(
            joint_names,
            self.settings.tracking_tolerance,
            self.tracking_tolerance_joints,
            whose='the guard',
        )


def _folders(names: Sequence[str] | None) -> tuple[Path, ...]:
    """Return folders that do not depend on where the process is."""
    folders = tuple(map(Path, names_in(names)))
    for folder in folders:
        if not folder.is_absolute():
            raise RequestError(
                Reason.INVALID_PARAMETER, f'mesh_roots must be absolute paths, got {str(folder)!r}'
            )
    return folders


def _introspection(name: str) -> ServiceIntrospectionState:
    """Return how much a service tells of its requests."""
    if name not in INTROSPECTION:
        raise RequestError(
            Reason.INVALID_PARAMETER,
            f'introspection must be one of {", ".join(INTROSPECTION)}, got {name!r}',
        )
    return INTROSPECTION[name]
