"""Scenes, checks and faults for scripted tests of fluid-solid coupling."""
