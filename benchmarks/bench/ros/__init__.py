"""Servers in processes of their own, and clients that ask them over real DDS."""
