"""A lifecycle node that no request to it can bring down or hold up."""

import threading
from typing import Any

from lifecycle_msgs.msg import State
from lifecycle_msgs.srv import ChangeState
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.lifecycle import LifecycleNodeMixin
from rclpy.node import Node


class ManagedNode(LifecycleNodeMixin, Node):
    """
    A node whose states somebody else may change, with the services of every lifecycle node.

    Unlike `rclpy.lifecycle.LifecycleNode` it answers `~/get_state` and all about parameters during
    a transition, and refuses one that its state does not have, where that one ends its process.

    :param name: of the node.
    :param options: as of every node.
    """

    def __init__(self, name: str, **options: Any) -> None:
        Node.__init__(self, name, **options)
        LifecycleNodeMixin.__init__(
            self, enable_communication_interface=True, callback_group=ReentrantCallbackGroup()
        )
        self._transition = threading.Lock()
        self._change = self._service_change_state.callback
        self._service_change_state.callback = self._change_if_possible

    @property
    def state(self) -> int:
        """The primary or transition state, a constant of lifecycle_msgs/State."""
        return int(self._state_machine.current_state[0])

    @property
    def loaded(self) -> bool:
        """Whether what it was configured with is in use, or about to be."""
        return self.state in (
            State.PRIMARY_STATE_ACTIVE,
            State.TRANSITION_STATE_CONFIGURING,
            State.TRANSITION_STATE_ACTIVATING,
        )

    def destroy_node(self) -> None:
        """Destroy the node, which its state machine keeps alive otherwise."""
        super().destroy_node()
        del self._state_machine

    def _change_if_possible(
        self, request: ChangeState.Request, response: ChangeState.Response
    ) -> ChangeState.Response:
        """Change the state; two changes at once would confuse the state machine."""
        if not self._transition.acquire(blocking=False):
            response.success = False
            return response
        try:
            return self._change(request, response)
        except Exception as error:
            self.get_logger().error(f'no such change of state: {error}')
            response.success = False
            return response
        finally:
            self._transition.release()
