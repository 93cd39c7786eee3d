"""Vessels and booms of a scenario: their bodies, their lines and moorings, and the oil that booms lose."""
