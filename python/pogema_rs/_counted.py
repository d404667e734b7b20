"""Numbers in messages."""


def counted(number: int, noun: str) -> str:
    """Returns a number with its noun, such as `1 start` or `2 starts`."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"
