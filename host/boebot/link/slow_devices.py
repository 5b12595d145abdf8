"""The slow devices' messages, and what turret and buzzer are to do, sent again until a message shows it
(protocol/PROTOCOL.md, "Delivery")."""

from __future__ import annotations

from boebot.devices.buzzer import next_token
from boebot.link import messages
from boebot.link.counters import HostCounters
from boebot.link.fields import reader
from boebot.link.line import Send

Kind = type[messages.Message]

_NEAR = 2  # counts that the board's pulse may lie beside the host's: both round
_BUZZER_TOKEN = reader(messages.DevicesTelemetry, "buzzer_token")
_TURRET_PULSE = reader(messages.DevicesTelemetry, "turret_pulse")


class SlowDevices:
    """The slow devices behind one link.

    Attributes:
        latest: the newest message of each kind in this session (payload): most robots send none.
        pending: a message is to show that turret or buzzer do what they were asked.
    """

    ROOM = 4096  # messages that wait to be fetched

    def __init__(self, send: Send, counts: HostCounters) -> None:
        self.latest: dict[Kind, bytes] = {}
        self.pending = False
        self._send = send
        self._counts = counts
        self._waiting: list[tuple[Kind, bytes]] = []
        self._turret: messages.Turret | None = None
        self._pulse = 0  # that shows it
        self._turret_sent_s: float | None = None
        self._tone: messages.Buzzer | None = None
        self._token = 0  # of the session's last tone
        self._tone_sent_s: float | None = None

    def set_turret(self, turret: messages.Turret, pulse: int) -> None:
        """What the turret is to do until a stop; devices_telemetry then shows `pulse` (counts; 0: none)."""
        self._turret, self._pulse, self._turret_sent_s = turret, pulse if turret.hold else 0, None
        self.pending = True

    def play_tone(self, tone: messages.Buzzer) -> None:
        """Plays a tone in place of one that has not begun; its token is given here."""
        self._token = next_token(self._token)
        self._tone, self._tone_sent_s = tone._replace(token=self._token), None
        self.pending = True

    def stop(self) -> None:
        """A stop releases the turret and silences the buzzer."""
        self._turret = self._tone = None
        self.pending = False

    def session_opened(self) -> None:
        """Tokens begin anew. A tone is not played again in another session; the turret is to turn back."""
        self._token = 0
        self._tone = None
        self._turret_sent_s = None
        self.pending = self._turret is not None

    def session_ended(self) -> None:
        """What came in it and was not fetched is dropped."""
        self.latest = {}
        self._waiting = []

    def receive(self, payload: bytes, kind: Kind = messages.DevicesTelemetry) -> None:
        """Takes a message. A tone that has begun is not sent again, nor is the release of a turret that is free. One
        that holds an angle still is to: a dead-man stop may release it."""
        self.latest[kind] = payload
        self._waiting.append((kind, payload))
        if len(self._waiting) > self.ROOM:
            self._counts.dropped += 1
            del self._waiting[0]
        if self.pending and kind is messages.DevicesTelemetry:
            if self._tone is not None and _BUZZER_TOKEN(payload) == (self._tone.token,):
                self._tone = None
            if self._pulse == 0 and self._turret_is_shown():
                self._turret = None
            self.pending = self._turret is not None or self._tone is not None

    def service(self, now_s: float, retry_s: float, latched: bool) -> None:
        """Sends what was not yet sent, or was `retry_s` ago and is not shown. A turret does not move while the motors
        are latched off."""
        if self._tone is not None and (self._tone_sent_s is None or now_s >= self._tone_sent_s + retry_s):
            self._counts.retransmitted += self._tone_sent_s is not None
            self._tone_sent_s = now_s
            self._send(self._tone)
        turret, sent_s = self._turret, self._turret_sent_s
        if turret is None or (latched and turret.hold):
            return
        if sent_s is None or (now_s >= sent_s + retry_s and not self._turret_is_shown()):
            self._counts.retransmitted += sent_s is not None
            self._turret_sent_s = now_s
            self._send(turret)

    def fetch(self) -> list[tuple[Kind, bytes]]:
        """Messages that came since the last call, kind and payload, oldest first."""
        found, self._waiting = self._waiting, []
        return found

    def _turret_is_shown(self) -> bool:
        newest = self.latest.get(messages.DevicesTelemetry)
        if newest is None:
            return False
        (pulse,) = _TURRET_PULSE(newest)
        return bool(pulse == self._pulse or (pulse != 0 != self._pulse and abs(pulse - self._pulse) <= _NEAR))
