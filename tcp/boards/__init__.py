"""Drill files put into a shorter order: one instance a tool, solved, chained, written, guarded."""
