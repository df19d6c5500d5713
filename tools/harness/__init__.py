"""Runs the real programs between real graphs: for demo, benchmark and end-to-end tests."""
