"""The training side of a scenario: its group, its learning goal, the trainee's brief and the instructor's notes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from scenarios.schema.parsing.quantity_fields import Section
from scenarios.text.problems import Problem

LONGEST_BRIEF = 4000  # [1] letters; a printed page has some 60 lines of 70
Group = Literal["sweeping", "containment", "protection", "deployment", "trial"]


@dataclass(frozen=True, kw_only=True)
class ExerciseSettings(Section):
    """An exercise for crews; it changes nothing in the run.

    group  under which `oilsim list` shows it: "sweeping", "containment", "protection", "deployment" or "trial"
    goal   what a trainee can do afterwards, in one sentence
    brief  text for the trainee, a page: situation, task, means, and how it is graded
    notes  text for the instructor: what to look at, what to say, what usually goes wrong, and the variants
    """

    group: Group
    goal: str
    brief: str = ""
    notes: str = ""

    def problems(self) -> Iterator[Problem]:
        """Check that there is a goal, and that the brief is a page."""
        if not self.goal.strip():
            yield Problem("goal", "is empty, allowed: one sentence")
        if len(self.brief) > LONGEST_BRIEF:
            text = f"has {len(self.brief)} letters, allowed: up to {LONGEST_BRIEF}, a page"
            yield Problem("brief", text)
