"""Robots whose effect stands in no catalogue: what a diagnosis discovers, and what that brings on fresh runs."""
