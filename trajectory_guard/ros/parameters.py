"""The parameters of the guard: name, default, range, unit, and whether they can change."""

from trajectory_guard.ros.declared import Declaration
from trajectory_guard.settings import LARGEST_LENGTH, Settings, SMALLEST_TOLERANCE

_DEFAULTS = Settings()

# Each takes a thread.
MOST_REQUESTS = 256

DECLARATIONS = {
    'autostart': Declaration(
        True, 'configure and activate at the start, without a manager', read_only=True
    ),
    'robot_description_file': Declaration(
        '', 'URDF file of the robot; empty: from robot_description_topic', at_configure=True
    ),
    'robot_description_topic': Declaration(
        'robot_description',
        'latched std_msgs/String with the URDF, read if robot_description_file is empty',
        at_configure=True,
    ),
    'scene_files': Declaration(
        [''],
        'URDF and mesh files of the scene; empty: there is only the live scene',
        at_configure=True,
    ),
    'scene_pose': Declaration(
        [0.0] * 6,
        'x, y, z [m], roll, pitch, yaw [rad] of the scene files in the root link of the robot',
        at_configure=True,
    ),
    'live_scene': Declaration(
        False,
        'markers belong to the scene, too; the guard is not ready before the first of them',
        at_configure=True,
    ),
    'scene_topic': Declaration(
        '~/scene',
        'latched visualization_msgs/MarkerArray with the live scene',
        at_configure=True,
    ),
    'max_scene_age': Declaration(
        0.0,
        'requests are rejected if the last markers came longer ago [s]; 0: they never get old',
        (0.0, 3600.0),
    ),
    'joint_states_topic': Declaration(
        'joint_states',
        'sensor_msgs/JointState for requests that lack a start state; empty: not used',
        at_configure=True,
    ),
    'max_state_age': Declaration(
        0.5, 'a joint state is fresh up to this age, by arrival and by stamp [s]', (0.05, 10.0)
    ),
    'tolerance': Declaration(
        _DEFAULTS.tolerance,
        'gaps larger than this are decided, smaller ones may be suspect [m]',
        (SMALLEST_TOLERANCE, LARGEST_LENGTH),
    ),
    'clearance': Declaration(
        _DEFAULTS.clearance,
        'distance that free must exceed, the least that a request can ask for [m]',
        (0.0, LARGEST_LENGTH),
    ),
    'tracking_tolerance': Declaration(
        list(_DEFAULTS.tracking_tolerance),
        'how far the robot may follow off the path, the least that a request can ask for '
        '[rad or m]: one value >= 0, or one for each of tracking_tolerance_joints',
    ),
    'tracking_tolerance_joints': Declaration(
        [''], 'joints that the values of tracking_tolerance belong to; empty: one value for all'
    ),
    'deadline': Declaration(
        10.0,
        'wall-clock time for an answer, what is not decided by then is suspect [s]',
        (1e-3, 3600.0),
    ),
    'max_pieces': Declaration(
        _DEFAULTS.max_pieces,
        'pieces of motion examined for an answer, what is left then is suspect',
        (1, 100_000_000),
    ),
    'cover': Declaration(
        _DEFAULTS.cover.name.lower(),
        'how motions are enclosed: hull, or ball, which proves no collisions and is slower',
    ),
    'refine': Declaration(
        _DEFAULTS.refine, 'look closer at suspect intervals, down to what rounding allows'
    ),
    'allowed_start_tolerance': Declaration(
        _DEFAULTS.allowed_start_tolerance,
        'how far the start state may be off a first point at time 0 [rad or m]',
        (0.0, 1.0),
    ),
    'joint_limit_tolerance': Declaration(
        _DEFAULTS.joint_limit_tolerance,
        'how far the path may leave the joint limits [rad or m]',
        (0.0, 1.0),
    ),
    'check_joint_limits': Declaration(
        _DEFAULTS.check_joint_limits, 'false leaves joint limits unchecked, and the answer says so'
    ),
    'allow_nonzero_end_velocity': Declaration(
        _DEFAULTS.allow_nonzero_end_velocity, 'accept a last point that does not come to rest'
    ),
    'max_points': Declaration(10_000, 'points that a trajectory may have', (1, 1_000_000)),
    'max_joints': Declaration(
        256, 'joints that a trajectory or a start state may have', (1, 10_000)
    ),
    'max_requests': Declaration(
        0,
        'requests that may be in flight, more are rejected as busy; 0: twice the cores',
        (0, MOST_REQUESTS),
    ),
    'max_markers': Declaration(
        1000, 'markers that the live scene may have', (1, 100_000), at_configure=True
    ),
    'max_mesh_bytes': Declaration(
        64 * 1024 * 1024,
        'size that a mesh file may have [bytes]',
        (1, 2**31 - 1),
        at_configure=True,
    ),
    'mesh_roots': Declaration(
        [''],
        'folders that meshes of the robot, of scene files and of markers must lie in; '
        'empty: anywhere',
        at_configure=True,
    ),
    'introspection': Declaration(
        'off', 'what ~/certify/_service_event tells of requests: off, metadata or contents'
    ),
}
