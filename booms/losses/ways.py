"""The two ways on which closures carry oil out of a boom."""

from __future__ import annotations

from booms.containment import Cause

UNDER_FOOT = (Cause.ENTRAINMENT, Cause.DRAINAGE, Cause.CRITICAL_ACCUMULATION, Cause.PLANING)
"""The causes by which oil passes under the skirt."""
OVER_TOP = (Cause.SUBMERGENCE, Cause.SPLASH_OVER)
"""The causes by which oil passes over the float."""
WAYS = (UNDER_FOOT, OVER_TOP)
