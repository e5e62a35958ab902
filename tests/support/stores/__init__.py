"""Databases, and what lies in them: stores, registries, roles, damage."""
