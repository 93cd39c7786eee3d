"""The faults of a scenario become the plan by which its run fails."""

from __future__ import annotations

from collections.abc import Mapping

from coupling.testkit.fault_plan import FaultPlan
from coupling.testkit.faults import Fault
from scenarios.schema.faults import FaultSettings, LineFault, ParticipantFault


def fault_plan(faults: Mapping[str, FaultSettings]) -> FaultPlan:
    """Return the plan of these faults."""
    plan = FaultPlan()
    for one in faults.values():
        if isinstance(one, ParticipantFault):
            plan.participant(one.name, Fault(one.fault), at_time=one.at)
        elif isinstance(one, LineFault):
            plan.line(one.name, at_time=one.at)
        else:
            plan.observer(Fault(one.fault), at_time=one.at)
    return plan
