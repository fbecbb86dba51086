"""Errors of the core: one exception per kind of input, one stable code per reason."""

from enum import Enum


class Reason(str, Enum):
    """
    Stable reason codes.

    The values appear in messages, in JSON and in diagnostics; they may be added to, not renamed.
    """

    # The trajectory, or the state it starts from.
    NO_POINTS = 'no_points'
    NO_JOINTS = 'no_joints'
    EFFORT_ONLY = 'effort_only'
    MISSING_POSITIONS = 'missing_positions'
    SIZE_MISMATCH = 'size_mismatch'
    NOT_FINITE = 'not_finite'
    UNSORTED_TIMES = 'unsorted_times'
    NEGATIVE_TIME = 'negative_time'
    DUPLICATE_JOINT = 'duplicate_joint'
    UNKNOWN_JOINT = 'unknown_joint'
    MIMIC_JOINT = 'mimic_joint'
    FIXED_JOINT = 'fixed_joint'
    ACCELERATIONS_WITHOUT_VELOCITIES = 'accelerations_without_velocities'
    NONZERO_END_VELOCITY = 'nonzero_end_velocity'
    JOINT_LIMIT = 'joint_limit'
    START_STATE_MISMATCH = 'start_state_mismatch'
    START_STATE_UNKNOWN = 'start_state_unknown'
    JOINT_POSITION_UNKNOWN = 'joint_position_unknown'
    TOO_LARGE = 'too_large'
    TRAJECTORY_UNREADABLE = 'trajectory_unreadable'
    AMBIGUOUS_TURN = 'ambiguous_turn'

    # The robot.
    ROBOT_INVALID = 'robot_invalid'
    ROBOT_EMPTY = 'robot_empty'
    JOINT_AXIS_INVALID = 'joint_axis_invalid'
    JOINT_UNSUPPORTED = 'joint_unsupported'
    LIMITS_MISSING = 'limits_missing'
    GEOMETRY_UNSUPPORTED = 'geometry_unsupported'
    MESH_MISSING = 'mesh_missing'
    MESH_INVALID = 'mesh_invalid'
    MESH_FORBIDDEN = 'mesh_forbidden'

    # The scene.
    SCENE_INVALID = 'scene_invalid'
    SCENE_EMPTY = 'scene_empty'
    SCENE_MISSING = 'scene_missing'
    SCENE_STALE = 'scene_stale'
    FRAME_UNKNOWN = 'frame_unknown'
    DUPLICATE_NAME = 'duplicate_name'

    # The request.
    INVALID_TOLERANCE = 'invalid_tolerance'
    INVALID_CLEARANCE = 'invalid_clearance'
    INVALID_TRACKING_TOLERANCE = 'invalid_tracking_tolerance'
    INVALID_DEADLINE = 'invalid_deadline'
    BELOW_MINIMUM = 'below_minimum'
    INVALID_PARAMETER = 'invalid_parameter'

    # The proof: why an interval is suspect.
    TOLERANCE = 'tolerance'
    DEPTH = 'depth'
    BUDGET = 'budget'
    DEADLINE = 'deadline'
    NOT_EXAMINED = 'not_examined'
    ENCLOSURE = 'enclosure'

    # A certificate.
    CERTIFICATE_INVALID = 'certificate_invalid'

    # The gate: where the robot is, and when the controller begins.
    STATE_STALE = 'state_stale'
    STATE_INCOMPLETE = 'state_incomplete'
    STATE_CHANGED = 'state_changed'
    STAMP_INVALID = 'stamp_invalid'
    STAMP_UNCERTAIN = 'stamp_uncertain'
    ENDS_IN_PAST = 'ends_in_past'

    # The gate: what else it decides by.
    PROVED_FREE = 'proved_free'
    STOP = 'stop'
    SUPERSEDED = 'superseded'
    STOPPED = 'stopped'
    CANCELED = 'canceled'
    MULTI_DOF = 'multi_dof'
    GUARD_MISSING = 'guard_missing'
    GUARD_AMBIGUOUS = 'guard_ambiguous'
    GUARD_NOT_READY = 'guard_not_ready'
    GUARD_SILENT = 'guard_silent'
    ANSWER_INVALID = 'answer_invalid'
    SCENE_CHANGED = 'scene_changed'
    CONTROLLER_MISSING = 'controller_missing'

    # The guard itself.
    BUSY = 'busy'
    NOT_READY = 'not_ready'
    INTERNAL_ERROR = 'internal_error'

    def __str__(self) -> str:
        """Return the code itself, on every Python version."""
        return self.value


class TrajectoryGuardError(Exception):
    """
    Base of every error the guard raises on purpose.

    :param reason: stable code, for programs.
    :param message: one sentence naming the field and the value, for people.
    """

    def __init__(self, reason: Reason, message: str) -> None:
        super().__init__(message)
        self.reason = reason

    def __reduce__(self) -> tuple[type, tuple[Reason, str]]:
        """Keep the reason when the error crosses a process border."""
        return type(self), (self.reason, str(self))


class TrajectoryError(TrajectoryGuardError):
    """The trajectory or its start state cannot be judged."""


class RobotError(TrajectoryGuardError):
    """The robot description cannot be used."""


class SceneError(TrajectoryGuardError):
    """The scene cannot be used."""


class RequestError(TrajectoryGuardError):
    """A setting of the request is out of its range."""
