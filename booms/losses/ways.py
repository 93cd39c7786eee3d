"""The two ways on which closures carry oil out of a boom."""

from __future__ import annotations

from oilsim.slick.loss_cause import LossCause

UNDER_FOOT = (LossCause.ENTRAINMENT, LossCause.DRAINAGE, LossCause.CRITICAL_ACCUMULATION, LossCause.PLANING)
"""The causes by which oil passes under the skirt."""
OVER_TOP = (LossCause.SUBMERGENCE, LossCause.SPLASH_OVER)
"""The causes by which oil passes over the float."""
WAYS = (UNDER_FOOT, OVER_TOP)
