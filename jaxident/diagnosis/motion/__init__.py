"""Poses of windows under the nominal robot and any effects, and how they answer to small changes."""
