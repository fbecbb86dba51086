"""Text that is safe to print; names and messages may come from strangers."""


def printable(text: str) -> str:
    """
    Return text that stays on its line and cannot steer a terminal.

    :param text: any text.
    """
    return ''.join(c if c.isprintable() else '\N{REPLACEMENT CHARACTER}' for c in text)
