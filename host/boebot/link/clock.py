"""The board's clock against the host's: offset and drift with bounds that hold (protocol/PROTOCOL.md, "Clock").

    host time of board time b:   h(b) = b + g + o + r (b - b0),   |r| <= 5500e-6

Each message bounds the line from one side: a probe was sent, and had travelled, before the board's time in its
answer; an answer or telemetry was received, less its way on the wire, after the time that it carries. In the plane of
(o, r) a bound is a half plane; what all of them leave is a convex polygon, and the true line lies in it. The estimate
is the polygon's centroid: the mean of all lines that fit, which for evenly distributed delays are equally likely. Its
error bound at a board time is the distance to the farther one of the polygon's extremes there.

A polygon never forgets, and rates wander. So two are kept, each begun half a window after the other; the older one
speaks, and is replaced by the younger when its window is over. While the rate wanders by at most w (1/s), the line that
is tangent at the end of a window W passes an old bound by at most w W^2 / 2: each bound is loosened by that much.
"""

from __future__ import annotations

import random
from collections import deque

from boebot.link import messages
from boebot.link.frame import FRAME_OVERHEAD
from boebot.link.line import NEVER, Line

Stamp = tuple[float, float, float]
"""(board time in s since its reset, host time in s on the transport's clock, error bound of the host time in s)"""

DRIFT_LIMIT = 5.5e-3  # of h's slope: clocks of +-5000 ppm, as ceramic resonators have at worst, and some to spare
WANDER = 0.02e-6  # 1/s: greatest change of the clocks' relative rate; a resonator that warms up by 1 K in a minute
WINDOW_S = 40.0  # how long a bound counts
_LOOSENED_S = WANDER * WINDOW_S**2 / 2
RESOLUTION_S = 2e-6  # the board rounds its time down to whole microseconds; and rounding here
_WORTH = 0.02  # share of the present bound, and time, that a new one has to win to be worth the work
_WORTH_S = 4e-6
_WORTH_MOST_S = 1e-3  # of the present bound
_ON_LINE_S = 1e-10
_WRAP_US = 1 << 32
_FAR_S = 1e4  # o at the beginning

# A delimiter may be shared with the neighbour, so it is not counted: the frame needs at least these.
_PROBE_BYTES = messages.ClockProbe.LENGTH + FRAME_OVERHEAD - 1
_ANSWER_BYTES = messages.ClockAnswer.LENGTH + FRAME_OVERHEAD - 1
_TELEMETRY_BYTES = messages.Telemetry.LENGTH + FRAME_OVERHEAD - 1

_Polygon = list[tuple[float, float]]


class BoardClock:
    """Offset and drift of one board's clock.

    Attributes:
        restarts: times that the bounds contradicted each other: a clock that jumped or drifts beyond the limit.
        probes: clock answers received.
    """

    def __init__(self, byte_s: float = 0.0) -> None:
        """`byte_s`: time that a byte needs on the line; 0 where that is not known, which loosens the bounds. Once the
        bounds have contradicted each other it is not believed any more."""
        self._byte_s = byte_s
        self.restarts = 0
        self.probes = 0
        self.forget()

    def forget(self) -> None:
        """A new session: the board may have been reset, or another one may be there."""
        self._known = False
        self._expected = False
        self._us = 0  # newest board time, unwrapped
        self._received_s = 0.0  # host time of its receipt
        self._polygons: list[_Polygon] = []  # older, younger
        self._began: list[float] = []  # board times

    @property
    def known(self) -> bool:
        """Whether any of the board's times has come."""
        return self._known

    @property
    def drift(self) -> float:
        """How much faster than the host's clock the board's runs, as a share: 100e-6 are 100 ppm."""
        return 1.0 / (1.0 + self._slope) - 1.0 if self._known else 0.0

    @property
    def offset(self) -> float:
        """Host time of board time 0 by the newest estimate (s)."""
        return self._middle - self._at_s * (1.0 + self._slope) if self._known else 0.0

    @property
    def bound(self) -> float:
        """Error bound of the host time of the newest board time (s)."""
        return self._bound if self._known else _FAR_S

    @property
    def bounded(self) -> bool:
        """Whether the newest board time's host time is known from both sides: a probe was answered."""
        return self._known and self._bound < _FAR_S / 4

    def expect(self, board_s: float, received_s: float) -> None:
        """The board's time is about this (s) at that host time: from its count of ticks, which rolls over later."""
        if not self._known:
            self._expected = True
            self._us, self._received_s = round(board_s * 1e6), received_s

    def unwrap(self, raw_us: int, received_s: float) -> int:
        """Board time (us) since reset from its low 32 bits, received at that host time: nearest to the expected one."""
        if not (self._known or self._expected):
            return raw_us
        expected = self._us + int((received_s - self._received_s) * 1e6)
        return raw_us + ((expected - raw_us + _WRAP_US // 2) // _WRAP_US) * _WRAP_US

    def probe(self, sent_s: float, raw_us: int, received_s: float) -> None:
        """Takes the board's time from the answer to a probe that was sent and answered at these host times."""
        self.probes += 1
        board_s = self._note(raw_us, received_s)
        byte_s = self._byte_s
        received_s -= _ANSWER_BYTES * byte_s
        sent_s += _PROBE_BYTES * byte_s - RESOLUTION_S
        since_s = board_s - self._at_s
        latest_wins = received_s - board_s < self._useful_below + since_s * self._useful_fastest
        earliest_wins = sent_s - board_s > self._useful_above + since_s * self._useful_slowest
        if latest_wins or since_s < 0:
            self._bound_by(board_s, received_s, 1.0)
        if (earliest_wins or since_s < 0) and self._byte_s == byte_s:
            self._bound_by(board_s, sent_s, -1.0)
        if latest_wins or earliest_wins:
            self._refresh(board_s)

    def observe(self, raw_us: int, received_s: float) -> Stamp:
        """Takes the time of a telemetry message's tick, received at that host time; returns the tick's stamp."""
        if not self._known:
            board_s = self._note(raw_us, received_s)
            self._bound_by(board_s, received_s - _TELEMETRY_BYTES * self._byte_s, 1.0)
            self._refresh(board_s)
        self._us, self._received_s = self.unwrap(raw_us, received_s), received_s
        board_s = self._us * 1e-6
        since_s = board_s - self._at_s
        latest_s = received_s - _TELEMETRY_BYTES * self._byte_s
        if latest_s - board_s < self._useful_below + since_s * self._useful_fastest:
            self._bound_by(board_s, latest_s, 1.0)
            self._refresh(board_s)
        return self._stamp(board_s)

    def stamp_earlier(self, raw_us: int) -> Stamp:
        """The stamp of a tick before the one that was observed last. It bounds nothing: its message was received
        together with the later one, so when it came is not known."""
        return self._stamp((self._us - (self._us - raw_us) % _WRAP_US) * 1e-6)

    # ---- inside --------------------------------------------------------------------------------------------

    def _stamp(self, board_s: float) -> Stamp:
        """Of a board time, by what is known of the clock."""
        since_s = board_s - self._at_s
        middle_s, bound_s = since_s * (1.0 + self._slope), abs(since_s) * self._slope_bound
        return board_s, self._middle + middle_s, self._bound + bound_s

    def _note(self, raw_us: int, received_s: float) -> float:
        """Notes a board time; returns it unwrapped (s)."""
        us = self.unwrap(raw_us, received_s)
        self._us, self._received_s = us, received_s
        board_s = us * 1e-6
        if not self._known:
            self._known = True
            self._zero = received_s - board_s  # g: keeps the polygon's numbers small
            self._polygons = [_plane()]
            self._began = [board_s]
            self._refresh(board_s)
        return board_s

    def _bound_by(self, board_s: float, host_s: float, side: float) -> None:
        """h(board_s) is at most (side 1) or at least (side -1) `host_s`."""
        self._turn_window(board_s)
        limit = host_s - board_s - self._zero + side * _LOOSENED_S
        for index, polygon in enumerate(self._polygons):
            cut = _cut(polygon, board_s - self._began[index], limit, side)
            if len(cut) < 3:  # nothing is left: the clock has jumped, or drifts faster than it may
                self.restarts += 1
                if self._byte_s:  # perhaps the line has no such rate: a pty, or USB all the way
                    self._byte_s = 0.0
                    self._polygons, self._began = [_plane()], [board_s]
                    return
                self._polygons = [_cut(_plane(), 0.0, limit, side)]
                self._began = [board_s]
                return
            self._polygons[index] = cut

    def _turn_window(self, board_s: float) -> None:
        if len(self._polygons) == 1:
            if board_s - self._began[0] > WINDOW_S / 2:
                self._polygons.append(_plane())
                self._began.append(board_s)
        elif board_s - self._began[0] > WINDOW_S:
            self._polygons = [self._polygons[1], _plane()]
            self._began = [self._began[1], board_s]

    def _refresh(self, board_s: float) -> None:
        """Estimate, bounds and what `observe` needs to know, for about this board time."""
        values, slopes = self._corners(0, board_s)
        low, high, slowest, fastest = min(values), max(values), min(slopes), max(slopes)
        value, slope = _centroid(values, slopes)
        if high - low > _FAR_S / 2:  # bounded from one side only
            value, slope = high, 0.0
        value = min(max(value, low), high)  # rounding, where the polygon is all but a point
        slope = min(max(slope, slowest), fastest)
        self._at_s = board_s
        self._middle = board_s + self._zero + value
        self._bound = max(high - value, value - low)
        self._slope = slope
        self._slope_bound = max(fastest - slope, slope - slowest)
        if len(self._polygons) > 1:
            values, slopes = self._corners(1, board_s)
            low, high, slowest, fastest = min(values), max(values), min(slopes), max(slopes)
        # a later bound between these cuts little or nothing off any polygon
        loosened_s = _LOOSENED_S + _WORTH_S + _WORTH * min(self._bound, _WORTH_MOST_S)
        self._useful_below = self._zero + high - loosened_s
        self._useful_above = self._zero + low + loosened_s
        self._useful_fastest = fastest
        self._useful_slowest = slowest

    def _corners(self, index: int, board_s: float) -> tuple[list[float], list[float]]:
        """Of a polygon at that board time: o + r (b - b0), and r."""
        x = board_s - self._began[index]
        return [o + r * x for o, r in self._polygons[index]], [r for _, r in self._polygons[index]]


def _plane() -> _Polygon:
    return [(-_FAR_S, -DRIFT_LIMIT), (_FAR_S, -DRIFT_LIMIT), (_FAR_S, DRIFT_LIMIT), (-_FAR_S, DRIFT_LIMIT)]


def _centroid(x: list[float], y: list[float]) -> tuple[float, float]:
    """Of the polygon with these corners; the middle of the extremes where it has no area."""
    x0, y0 = x[0], y[0]
    area = sum_x = sum_y = before_x = before_y = 0.0
    for corner_x, corner_y in zip(x, y, strict=True):
        corner_x -= x0
        corner_y -= y0
        doubled = before_x * corner_y - corner_x * before_y
        area += doubled
        sum_x += (before_x + corner_x) * doubled
        sum_y += (before_y + corner_y) * doubled
        before_x, before_y = corner_x, corner_y
    if not area:
        return (min(x) + max(x)) / 2, (min(y) + max(y)) / 2
    return x0 + sum_x / (3 * area), y0 + sum_y / (3 * area)


def _cut(polygon: _Polygon, x: float, limit: float, side: float) -> _Polygon:
    """The part of the convex polygon in which side (o + r x) <= side limit (Sutherland and Hodgman 1974). A corner that
    is on the line but for rounding stays, and is not cut off a second time: bounds that meet in a point, as with
    constant delays, would pile up corners there."""
    over = [side * (o + r * x - limit) - _ON_LINE_S for o, r in polygon]
    if max(over) <= 0.0:
        return polygon
    kept: _Polygon = []
    before, before_over = polygon[-1], over[-1]
    for vertex, vertex_over in zip(polygon, over, strict=True):
        if (vertex_over > 0.0) != (before_over > 0.0) and min(vertex_over, before_over) < -2 * _ON_LINE_S:
            share = before_over / (before_over - vertex_over)
            kept.append((before[0] + share * (vertex[0] - before[0]), before[1] + share * (vertex[1] - before[1])))
        if vertex_over <= 0.0:
            kept.append(vertex)
        before, before_over = vertex, vertex_over
    return kept


_KEPT = 64  # probes that may still be answered
_IN_TIME_OUT = 4.5  # at least four, for the intervals are drawn
_WARM_UP_S = 6.0  # the clock wants many probes at first
_WARM_S = 0.02
_THEN_S = 0.05
_WARM_SIMULATED_S = 0.05  # on a line without jitter few do
_THEN_SIMULATED_S = 0.2
_BYTES_EACH = 14
_SHARE = 0.1  # of the line
_TOKENS = 1 << 16
_RECENT = 8  # round trips that retries follow
_REMEMBERED = 256  # for figures


class RoundTrips:
    """Round trips of clock probes (s)."""

    def __init__(self) -> None:
        self._seen: deque[float] = deque(maxlen=_REMEMBERED)
        self._recent: deque[float] = deque([0.0], maxlen=_RECENT)

    def add(self, took_s: float) -> None:
        """A probe was answered after `took_s`."""
        self._seen.append(took_s)
        self._recent.append(took_s)

    def longest(self) -> float:
        """Of the last eight; 0 before the first."""
        return max(self._recent)

    def quantile(self, share: float) -> float | None:
        """Of the last 256; None before the first."""
        ordered = sorted(self._seen)
        return ordered[min(int(share * len(ordered)), len(ordered) - 1)] if ordered else None


class ClockSync:
    """The probes of one link, and what follows from their answers.

    Attributes:
        estimate: the board's clock against the transport's.
        round_trips: of the probes.
        began_us: board time of the session's first telemetry; None before.
    """

    def __init__(self, line: Line, draw: random.Random) -> None:
        """Probes by `line`; `draw` makes their intervals irregular."""
        self.round_trips = RoundTrips()
        self.began_us: int | None = None
        self._line = line
        self._draw = draw
        self._token = 0  # of the newest probe
        self._waiting: dict[int, float] = {}  # token -> when it was sent, oldest first
        self._due_s = NEVER
        self._opened_s = 0.0
        realtime = line.transport.realtime
        self._warm_s, self._then_s = (_WARM_S, _THEN_S) if realtime else (_WARM_SIMULATED_S, _THEN_SIMULATED_S)
        self._renew_estimate()

    def session_opened(self, now_s: float) -> None:
        """Begins anew: the board may have been reset, or another one may be there."""
        if self._byte_s != self._line.known_byte_s:
            self._renew_estimate()
        self.estimate.forget()
        self._opened_s = self._due_s = now_s

    def session_ended(self) -> None:
        """No more probes until the next session."""
        self._waiting.clear()
        self._due_s = NEVER
        self.began_us = None

    def begin(self, tick_s: float, raw_us: int, now_s: float) -> None:
        """The session's first telemetry: its time by the count of ticks, which rolls over late, and by the clock."""
        self.estimate.expect(tick_s, now_s)
        self.began_us = self.estimate.unwrap(raw_us, now_s)

    def service(self, now_s: float, time_out_s: float) -> float:
        """Sends a probe if it is time; returns when it is the next time (s): drawn, so that no rhythm of the line hides
        its shortest delay; often enough for a session that ends after `time_out_s` of silence."""
        if now_s >= self._due_s:
            self._send_probe()
            wanted = self._warm_s if now_s - self._opened_s < _WARM_UP_S else self._then_s
            wanted = min(max(wanted, _BYTES_EACH * self._line.byte_s / _SHARE), time_out_s / _IN_TIME_OUT)
            self._due_s = now_s + wanted * (0.5 + 0.5 * self._draw.random())
        return self._due_s

    def receive(self, payload: bytes, now_s: float) -> None:
        """Takes a `clock_answer`."""
        answer = messages.ClockAnswer.unpack(payload)
        sent_s = self._waiting.pop(answer.token, None)
        if sent_s is not None and self.began_us is not None:
            self.round_trips.add(now_s - sent_s)
            self.estimate.probe(sent_s, answer.time, now_s)

    def _send_probe(self) -> None:
        self._token = (self._token + 1) % _TOKENS
        if len(self._waiting) >= _KEPT:
            del self._waiting[next(iter(self._waiting))]
        self._waiting[self._token] = self._line.now()
        self._line.send(messages.ClockProbe(self._token))

    def _renew_estimate(self) -> None:
        self._byte_s = self._line.known_byte_s
        self.estimate = BoardClock(byte_s=self._byte_s)
