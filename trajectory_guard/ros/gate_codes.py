"""What each code in a decision of the gate, or in its status, calls for."""

from trajectory_guard.errors import Reason

# Codes of trajectories that were passed on.
PASSED = (Reason.PROVED_FREE, Reason.STOP)

# Codes of what was held, and of a gate that is not ready: what to do about it. Any other code in a
# decision is the guard's, or one of a trajectory that no controller could play.
REMEDIES = {
    Reason.STATE_STALE: 'see that joint_states has every joint, with stamps of this clock',
    Reason.STATE_INCOMPLETE: 'publish velocities; set state_interfaces as the controller has it',
    Reason.STATE_CHANGED: 'send it when the robot stands still, or raise max_drift or '
    'max_velocity_drift, for which more clearance is needed',
    Reason.START_STATE_MISMATCH: 'plan from where the robot is now',
    Reason.STAMP_INVALID: 'set header.stamp to 0, or to an instant of the clock',
    Reason.STAMP_UNCERTAIN: 'set header.stamp to 0, or by more than max_start_delay ahead',
    Reason.ENDS_IN_PAST: 'set header.stamp to 0; the controller refuses it, too',
    Reason.SUPERSEDED: 'nothing: the newer trajectory is decided on its own',
    Reason.STOPPED: 'nothing: a stop came while it was certified',
    Reason.CANCELED: 'nothing: the goal was canceled while it was certified',
    Reason.MULTI_DOF: 'send joint trajectories only',
    Reason.GUARD_MISSING: 'start the guard, or set the parameter guard to its name',
    Reason.GUARD_AMBIGUOUS: 'stop all guards of that name but one',
    Reason.GUARD_NOT_READY: 'see the status and the log of the guard',
    Reason.GUARD_SILENT: 'see whether the guard lives; raise deadline if it needs longer',
    Reason.ANSWER_INVALID: 'see that gate and guard are of the same version',
    Reason.SCENE_CHANGED: 'send it again: it was certified in another scene',
    Reason.CONTROLLER_MISSING: 'start the controller, or set output_topic or controller_action',
    Reason.INTERNAL_ERROR: 'report it, with the log of the gate',
}


def remedy(code: str) -> str:
    """Return what to do about a code; those of the guard speak for themselves."""
    return {reason.value: text for reason, text in REMEDIES.items()}.get(
        code, 'the message says what is wrong with the motion or the request'
    )
