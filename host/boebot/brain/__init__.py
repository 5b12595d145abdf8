"""Brains of processes: behaviors and cognitive processes, weighed by utility functions (chapter 8 of the notes)."""

from boebot.brain.brain import Brain, BrainStep, Switch
from boebot.brain.fixed_action import Action, FixedActionPattern
from boebot.brain.machine import Machine
from boebot.brain.process import CognitiveProcess, MotorBehavior, Process
from boebot.brain.utility import Utility
from boebot.brain.variables import StateVariable, maximum, mean, minimum

__all__ = [
    "Action",
    "Brain",
    "BrainStep",
    "CognitiveProcess",
    "FixedActionPattern",
    "Machine",
    "MotorBehavior",
    "Process",
    "StateVariable",
    "Switch",
    "Utility",
    "maximum",
    "mean",
    "minimum",
]
