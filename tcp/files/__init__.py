"""Readers and writers: text in, Workpiece out, and back."""
