"""The bench for scripted tests: a pytest plugin, scenes without particles, and scenario runs under test.

This file imports nothing, because pytest loads the plugin in every session of every project where oilsim is installed.
"""
