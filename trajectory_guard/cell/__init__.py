"""Robot and scene: read, checked, and packed for every request."""
