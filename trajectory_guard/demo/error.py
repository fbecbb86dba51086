"""The error of a demo that cannot go on."""


class DemoError(Exception):
    """What a person has to know, or to do, before the demo can work."""
