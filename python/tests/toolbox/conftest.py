"""Restores what the tests register."""

import copy
import logging

import pytest
from pogema_rs.toolbox.registry import ToolboxRegistry


@pytest.fixture(autouse=True)
def restored_registry():
    """Restores the registry and its logger after each test."""
    state = {name: copy.copy(value) for name, value in ToolboxRegistry.get_state().items()}
    logger = logging.getLogger("pogema_rs.toolbox")
    kept = logger.handlers, logger.propagate, logger.level
    yield
    logger.handlers, logger.propagate = kept[:2]
    logger.setLevel(kept[2])
    ToolboxRegistry.recreate_from_state(state)
