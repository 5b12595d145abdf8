"""The longest time from the request of an interrupt to its acceptance: response-time analysis without preemption.

An interrupt that is requested waits for what runs: an instruction, a stretch of the main program with interrupts off,
or another interrupt, which lets no other in. Take the last moment before its acceptance at which none of higher
priority (lower vector) was waiting or running. What then runs is one that has just begun, of lower priority or its own
kind if it can come again so soon, of B cycles at most, or nothing but the main program. Up to its acceptance there come
those of higher priority, each as often as it can in that time, and after the return of each, and of the first, the main
program goes one step (steps.py): one instruction or, if that switches interrupts off, all until they can come again. If
none had begun, that step is the one under way. So its wait is not above the least L with

    L = B + steps(1 + sum of N_i(L)) + sum of N_i(L) * C_i        over those of higher priority

where N_i(L) is the most requests of i in L + 1 cycles; after A. Burns, A. Wellings, "Real-Time Systems and Programming
Languages", 11.8 (blocking by what cannot be preempted). C_i runs from acceptance (entry: 4 cycles) to the end of RETI;
of an interrupt that lets others in, to where it does so.

Each has one flag (data sheet, 11): requests of one kind do not pile up. But the last moment at which none of higher
priority was waiting may be the one at which the request before this one was accepted: then B is its own time. That
was at most L after the request before; so it need not be heeded where no two of its requests come within L and the time
that passes, by the same formula, from that acceptance on.

Received bytes queue, and are taken by other interrupts than their own: they are looked at in byte_waits.py.

How often they come, the caller says (`Source`). That is not the rate in the long run: requests may come in bursts.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from functools import cached_property

from avr_timing.interrupts.byte_reads import RECEIVE, ByteReads
from avr_timing.interrupts.byte_waits import Line, Other, longest_wait
from avr_timing.interrupts.interrupts_off import InterruptsOff
from avr_timing.interrupts.response import Source
from avr_timing.interrupts.steps import Steps
from boebot.errors import AnalysisError

HORIZON = 1 << 20  # cycles, 65 ms: who waits longer waits for ever


Requests = Mapping[int, Sequence[Source]]  # by vector, what asks for the interrupt, at most


class Latencies:
    """Of the interrupts of an image. What does not depend on their requests is worked out once."""

    def __init__(
        self,
        blocked: InterruptsOff,
        *,
        apart: Mapping[int, Collection[int]] | None = None,
        never_near: Sequence[int] = (),
    ) -> None:
        """
        Args:
            blocked: stretches of the image without interrupts.
            apart: by vector, those that never come while this interrupt waits.
            never_near: of these, at most all but one come while a received byte waits.
        """
        self.blocked = blocked
        self._taken: dict[int, ByteReads] = {}
        self._apart: Mapping[int, Collection[int]] = apart or {}
        self._never_near: Sequence[int | None] = never_near

    @cached_property
    def _steps(self) -> Steps:
        return Steps(self.blocked)

    def taken(self, vector: int) -> ByteReads:
        """The bytes that an interrupt takes."""
        if vector not in self._taken:
            self._taken[vector] = ByteReads(self.blocked.worst_case, 4 * vector)
        return self._taken[vector]

    def of(self, vector: int, requests: Requests) -> int:
        """Most cycles from the request of an interrupt to its acceptance. HORIZON: those of higher priority can take
        all the time.

        Raises:
            AnalysisError: one of higher priority is in use, and the image does not say how often it can come.
        """
        others = [number for number in self.blocked.vectors() if number not in self._apart.get(vector, ())]
        higher = [number for number in others if number < vector]
        for number in higher:
            if number not in requests:
                raise AnalysisError(
                    f"{self.blocked.program.path}: interrupt {number} goes before interrupt {vector}, and how often it "
                    "comes is not said; expected requests of it"
                )
        lower = max((self.blocked.interrupt(number)[0] for number in others if number > vector), default=0)
        if vector == RECEIVE and requests.get(vector):
            return self._received(requests, higher, lower)
        span = self.blocked.interrupt(vector)[0]
        wait, after_own = self._behind(requests, lower, higher), self._behind(requests, span, higher)
        own = requests.get(vector)
        again = own is None or sum(one.requests(wait + after_own + 1) for one in own) > 1
        return max(wait, after_own) if again else wait

    def _received(self, requests: Requests, higher: Sequence[int], lower: int) -> int:
        """Of a byte, which the receiver keeps until somebody takes it."""
        others: dict[int, Other] = {}
        for number in higher:
            if (latency := self.of(number, requests)) >= HORIZON:
                return HORIZON
            others[number] = Other(self.taken(number), requests[number], latency, self.blocked.interrupt(number)[0])
        inner = any(self.blocked.interrupt(number)[1] is not None for number in higher)

        def steps(count: int) -> int:
            return self._steps.most(count, count if inner else 0)

        own = self.taken(RECEIVE)

        def wait(without: int | None) -> int:
            near = {number: other for number, other in others.items() if number != without}
            return longest_wait(Line(own, requests[RECEIVE], near, lower, steps), HORIZON)

        return max(map(wait, self._never_near or (None,)))

    def _behind(self, requests: Requests, begun: int, higher: Sequence[int]) -> int:
        """The wait where one that takes this long has just begun."""
        wait, longer = -1, begun
        while longer > wait:
            if longer >= HORIZON:
                return HORIZON
            wait, longer = longer, begun + self._meanwhile(requests, higher, longer)
        return wait

    def _meanwhile(self, requests: Requests, higher: Sequence[int], wait: int) -> int:
        """What those of higher priority and the main program run in that time."""
        counts = {number: sum(one.requests(wait + 1) for one in requests[number]) for number in higher}
        inner = sum(count for number, count in counts.items() if self.blocked.interrupt(number)[1] is not None)
        return self._steps.most(1 + sum(counts.values()), inner) + sum(
            count * self.blocked.interrupt(number)[0] for number, count in counts.items()
        )
