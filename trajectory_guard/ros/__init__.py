"""
The doors to a running ROS 2 system; the only place that imports rclpy.

A node converts a message, calls the core and converts the answer. It decides nothing itself, but
for one thing: whatever goes wrong, the answer is *rejected* with a reason code.
"""
