"""The action FollowJointTrajectory before the controller's own."""

from typing import Any


def action_before(node: Any, controller_action: str, keeper: Any) -> Any:
    return None
