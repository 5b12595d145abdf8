"""Brains of processes: behaviors and cognitive processes, weighed by utility functions (chapter 8 of the notes)."""

from boebot.brain.brain import Brain as Brain
from boebot.brain.brain import BrainStep as BrainStep
from boebot.brain.brain import Switch as Switch
from boebot.brain.fixed_action import Action as Action
from boebot.brain.fixed_action import FixedActionPattern as FixedActionPattern
from boebot.brain.machine import Machine as Machine
from boebot.brain.process import CognitiveProcess as CognitiveProcess
from boebot.brain.process import MotorBehavior as MotorBehavior
from boebot.brain.process import Process as Process
from boebot.brain.utility import Utility as Utility
from boebot.brain.variables import StateVariable as StateVariable
from boebot.brain.variables import maximum as maximum
from boebot.brain.variables import mean as mean
from boebot.brain.variables import minimum as minimum
from boebot.offered import offered

__all__ = offered(__name__)
