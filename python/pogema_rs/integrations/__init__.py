"""Environments for the frameworks that train on them."""
