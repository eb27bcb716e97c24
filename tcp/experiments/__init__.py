"""Repeated runs, statistics, the papers' tables."""
