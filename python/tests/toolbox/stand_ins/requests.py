"""Stands in for requests: reads a URL of a file."""

from types import SimpleNamespace
from urllib.request import urlopen


def get(url):
    """Returns a response with the content."""
    with urlopen(url) as file:
        return SimpleNamespace(content=file.read())
