"""Animations of episodes."""
