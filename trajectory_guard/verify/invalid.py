"""The one way in which a certificate fails."""

from trajectory_guard.errors import Reason, TrajectoryGuardError


def invalid(message: str) -> TrajectoryGuardError:
    """
    Return the error of a certificate that does not prove what it claims.

    :param message: names the field or entry, and its values.
    """
    return TrajectoryGuardError(Reason.CERTIFICATE_INVALID, message)
