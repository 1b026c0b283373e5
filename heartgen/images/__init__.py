"""Masks in the world: reading, checking, and the surfaces they imply."""
