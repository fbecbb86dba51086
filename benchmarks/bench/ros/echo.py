"""A server of the guard's service that answers at once, and always with the empty answer."""

import rclpy
from rclpy.node import Node
from trajectory_guard_interfaces.srv import CertifyTrajectory


def main() -> None:
    """Answer until the process is ended."""
    rclpy.init()
    node = Node('echo')
    node.create_service(CertifyTrajectory, '~/certify', lambda request, response: response)
    rclpy.spin(node)


if __name__ == '__main__':
    main()
