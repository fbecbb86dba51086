"""The parameters of the gate: name, default, range, unit, and whether they can change."""

from trajectory_guard.ros.declared import Declaration
from trajectory_guard.settings import LARGEST_LENGTH

DECLARATIONS = {
    'guard': Declaration(
        'guard', 'name of the node that certifies, with its namespace', read_only=True
    ),
    'input_topic': Declaration(
        '~/trajectory', 'trajectories to check (trajectory_msgs/JointTrajectory)', read_only=True
    ),
    'output_topic': Declaration(
        'joint_trajectory_controller/joint_trajectory',
        'topic of the controller, where what is proved free is passed on',
        read_only=True,
    ),
    'joint_states_topic': Declaration(
        'joint_states', 'sensor_msgs/JointState of the robot, stamped', read_only=True
    ),
    'controller_action': Declaration(
        'joint_trajectory_controller/follow_joint_trajectory',
        'action of the controller that ~/follow_joint_trajectory stands before; empty: none',
        read_only=True,
    ),
    'state_interfaces': Declaration(
        ['position', 'velocity'],
        'state_interfaces of the controller: what it reads of the robot when it begins',
    ),
    'continuous_joints': Declaration(
        [''], 'continuous joints, of which the controller does not count whole turns'
    ),
    'max_state_age': Declaration(
        0.1,
        'a joint state is fresh up to this age, by its stamp and by its arrival [s]',
        (1e-3, 10.0),
    ),
    'max_drift': Declaration(
        0.002,
        'how far a joint may be off the certified state when the controller begins [rad or m]',
        (0.0, 1.0),
    ),
    'max_velocity_drift': Declaration(
        0.01,
        'how far the velocity of a joint may be off then [rad/s or m/s]; '
        'one that is not measured is taken to be below this',
        (0.0, 10.0),
    ),
    'max_start_delay': Declaration(
        0.02,
        'from passing on to the first sample of the controller; '
        'how far its clock may differ, too [s]',
        (0.0, 10.0),
    ),
    'allowed_start_tolerance': Declaration(
        0.01,
        'how far the robot may be off the path where the controller does not approach it '
        '[rad or m]',
        (0.0, 1.0),
    ),
    'tracking_tolerance': Declaration(
        [0.0],
        'how far the robot may follow off the path [rad or m]: one value >= 0, or one for each of '
        "tracking_tolerance_joints; the guard's own where that is larger",
    ),
    'tracking_tolerance_joints': Declaration(
        [''], 'joints that the values of tracking_tolerance belong to; empty: one value for all'
    ),
    'clearance': Declaration(
        0.0, "distance that free must exceed [m]; 0: the guard's own", (0.0, LARGEST_LENGTH)
    ),
    'tolerance': Declaration(
        0.0, "gaps larger than this are decided [m]; 0: the guard's own", (0.0, LARGEST_LENGTH)
    ),
    'deadline': Declaration(1.0, 'time for the answer of the guard [s]', (1e-3, 3600.0)),
    'answer_margin': Declaration(
        0.1, 'how much later than that its answer may arrive [s]', (0.0, 10.0)
    ),
}
