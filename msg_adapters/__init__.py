"""
Messages to core values and back.

Live rclpy messages, messages read from a bag and messages read from text differ in their classes
but not in their attribute names, so everything here goes by attribute name. Nothing here imports
ROS when it is imported itself.
"""
