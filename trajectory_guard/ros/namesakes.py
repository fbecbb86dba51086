"""Other guards of the same name, of which a client cannot tell whom it asks."""

import time

from rclpy.node import Node

# Who else is there is known so long after a node was made [s].
DISCOVERY = 1.5


class Namesakes:
    """
    Looks for other nodes of the node's full name.

    One that ends is gone at once; one that is killed stays in the graph for as long as its
    middleware granted it (20 s for Fast DDS), but only for those who knew it: whoever takes its
    place never hears of it.

    :param node: whose namesakes they are.
    :param topic: that every node of that name publishes, known earlier than its name.
    """

    def __init__(self, node: Node, topic: str) -> None:
        self._node = node
        self._topic = node.resolve_topic_name(topic)
        self._made = time.monotonic()
        self._any = False

    @property
    def any(self) -> bool:
        """Whether there was one when it was looked last."""
        return self._any

    def look(self) -> bool:
        """Look again, and return whether there is one."""
        mine = (self._node.get_name(), self._node.get_namespace())
        self._any = (
            self._node.count_publishers(self._topic) > 1
            or self._node.get_node_names_and_namespaces().count(mine) > 1
        )
        return self._any

    def wait(self) -> bool:
        """Look until all are known, and return whether there is one."""
        while not self.look() and time.monotonic() < self._made + DISCOVERY:
            time.sleep(DISCOVERY / 20)
        return self._any
