"""What a viewer shows: live obstacles, and the moments of an answer."""
