"""The part of the demo that talks to the guard."""
