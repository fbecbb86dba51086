"""
Three trajectories of a real robot, certified through the guard's service.

``./bringup demo`` starts the guard as its own process, asks it, and prints what it answers beside
what a check of single poses would have said.
"""
