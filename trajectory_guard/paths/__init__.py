"""What the controller plays: messages as curves in joint space or of poses."""
