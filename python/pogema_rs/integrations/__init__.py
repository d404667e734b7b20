"""Adapters of environments for training frameworks."""
