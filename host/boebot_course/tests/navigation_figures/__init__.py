"""Figures of navigation: see __main__.py."""
