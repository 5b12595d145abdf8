"""What is wanted of turret and buzzer, told again until devices_telemetry shows it (protocol/PROTOCOL.md, "Delivery").

State only: nothing here sends, waits or knows a clock. `traffic.py` passes the time in and the messages on.
"""

from __future__ import annotations

import math

from boebot.link import messages

_TURRET_PULSE = messages.DevicesTelemetry.OFFSETS["turret_pulse"]
_BUZZER_TOKEN = messages.DevicesTelemetry.OFFSETS["buzzer_token"]
_NEAR = 2  # counts that the board's pulse may lie beside the host's: both round


class Wanted:
    """How the turret shall be, and the tone that shall sound.

    Attributes:
        any: something is wanted.
        token: of the last tone of this session.
        retransmitted: counted.
    """

    def __init__(self) -> None:
        self.any = False
        self.token = 0
        self.retransmitted = 0
        self._turret: messages.Turret | None = None
        self._pulse = 0  # that shows it
        self._turret_told_s = -math.inf
        self._tone: messages.Buzzer | None = None
        self._tone_told_s = -math.inf

    def turn(self, turret: messages.Turret, pulse: int) -> None:
        """The turret shall be so, until a stop; `pulse` (counts, 0: none) in devices_telemetry then shows it."""
        self._turret, self._pulse, self._turret_told_s = turret, pulse, -math.inf
        self.any = True

    def sound(self, tone: messages.Buzzer) -> None:
        """That tone shall sound, in place of one that was not yet heard."""
        self._tone, self.token, self._tone_told_s = tone, tone.token, -math.inf
        self.any = True

    def stopped(self) -> None:
        """A stop releases the turret and silences the buzzer: nothing of them is wanted any more."""
        self._turret = self._tone = None
        self.any = False

    def new_session(self) -> None:
        """Tokens begin anew. A tone is not told again in another session; the turret is still wanted so."""
        self.token = 0
        self._tone = None
        self._turret_told_s = -math.inf
        self.any = self._turret is not None

    def shown(self, devices: bytes) -> None:
        """Takes a devices_telemetry: a tone that has begun is not told again, nor is a turret that was to be released
        and is. One that holds an angle is still wanted: a dead-man stop may release it."""
        if self._tone is not None and devices[_BUZZER_TOKEN] == self._tone.token:
            self._tone = None
        if self._pulse == 0 and self._shows_turret(devices):
            self._turret = None
        self.any = self._turret is not None or self._tone is not None

    def due(self, now_s: float, retry_s: float, latched: bool, devices: bytes | None) -> list[messages.Message]:
        """What is to be told now: the first time, or again where it was told `retry_s` ago and is not shown. A latched
        turret is not told to move."""
        found: list[messages.Message] = []
        if self._tone is not None and now_s >= self._tone_told_s + retry_s:
            self.retransmitted += self._tone_told_s > -math.inf
            self._tone_told_s = now_s
            found.append(self._tone)
        turret = self._turret
        if turret is None or now_s < self._turret_told_s + retry_s or (latched and turret.hold):
            return found
        if self._turret_told_s == -math.inf or not (devices is not None and self._shows_turret(devices)):
            self.retransmitted += self._turret_told_s > -math.inf
            self._turret_told_s = now_s
            found.append(turret)
        return found

    def _shows_turret(self, devices: bytes) -> bool:
        pulse = int.from_bytes(devices[_TURRET_PULSE : _TURRET_PULSE + 2], "little")
        return pulse == self._pulse or (pulse != 0 != self._pulse and abs(pulse - self._pulse) <= _NEAR)
