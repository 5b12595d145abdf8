"""Both ends of the link over a line that loses, doubles, delays and damages, while either is reset at any moment.

A stateful property test: hypothesis chooses what happens, the rules below say what must hold all the time, and at the
end, when the line works again, everything must flow within a second.
"""

from __future__ import annotations

import pytest
from channel import Channel, uniform
from hypothesis import Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule, run_state_machine_as_test

from boebot.errors import BoardError
from boebot.link import messages
from boebot.link.delivery import Events, Request
from boebot.link.errors import SessionLostError, TakenOverError
from boebot.link.link import Link
from peer import QUEUE, InProcess, Peer, Protections, without

VALUES = messages.PARAMETERS["wheel_radius"]
RESUME_S = 1.0
PATIENCE_S = 1.0 + 0.35  # of the board with a host that has gone, and until its next hello has come


class LinkModel(RuleBasedStateMachine):
    """The host's link, the model of the board, and a line between them."""

    protections = Protections()

    def __init__(self) -> None:
        super().__init__()
        self.peer = Peer(protections=self.protections)
        self.session = InProcess(self.peer, Channel())
        self.link = Link(self.session)
        self.asked: list[tuple[int, Request]] = []
        self.received: list[int] = []
        self.happened = 0
        self.value = VALUES.minimum

    @initialize(seed=st.integers(0, 1000))
    def begin(self, seed: int) -> None:
        self.seed = seed
        self.link.open()

    # ---- what may happen ---------------------------------------------------------------------------------------------

    @rule(
        loss=st.sampled_from([0.0, 0.1, 0.5]),
        duplication=st.sampled_from([0.0, 0.3]),
        copy_delay_s=st.sampled_from([0.001, 0.05, 0.5]),
        bit_errors=st.sampled_from([0.0, 1e-3]),
        latency_s=st.sampled_from([0.0, 0.005, 0.05]),
    )
    def line_changes(
        self, loss: float, duplication: float, copy_delay_s: float, bit_errors: float, latency_s: float
    ) -> None:
        self.session.channel = Channel(
            loss=loss,
            duplication=duplication,
            copy_delay_s=copy_delay_s,
            bit_errors=bit_errors,
            to_board=uniform(0.0, latency_s),
            to_host=uniform(0.0, latency_s),
            seed=(self.seed, self.session.now()),
        )

    @rule(seconds=st.sampled_from([0.003, 0.02, 0.1, 0.4]))
    def time_passes(self, seconds: float) -> None:
        self.listen(seconds)

    @rule()
    def host_asks(self) -> None:
        self.value += 1
        try:
            request = self.link.submit(messages.SetParameter, VALUES.id, self.value, what="set")
        except BoardError:
            return  # one is under way
        self.asked.append((self.value, request))

    @rule()
    def something_happens_on_the_board(self) -> None:
        self.happened += 1
        self.peer._happened(messages.EventKind.DEAD_MAN, self.happened)

    @rule()
    def host_stops(self) -> None:
        self.link.stop()

    @rule(after_s=st.floats(0.0, 0.05))
    def board_is_reset(self, after_s: float) -> None:
        """In the midst of what goes on then."""
        self.session.at(self.session.now() + after_s, self.peer.reset)
        self.listen(0.06)

    @rule()
    def board_ends_the_session(self) -> None:
        if self.peer.session:
            self.peer._end_session()

    @rule(polite=st.booleans())
    def host_is_started_anew(self, polite: bool) -> None:
        if polite:
            self.link.close()
        for _, request in self.asked:
            if not request.done:
                request.error = SessionLostError("that host is no more")
        self.link = Link(self.session)
        self.link.session._draw.seed(f"{self.seed} {self.session.now()}")
        self.link.session._wanted = True

    @rule(seconds=st.sampled_from([0.05, 0.5, 2.0]))
    def host_sleeps(self, seconds: float) -> None:
        end = self.session.now() + seconds
        while self.session.now() < end - 1e-9:
            self.session.read(end - self.session.now(), end - self.session.now())  # and what came meanwhile is lost

    # ---- what must hold ----------------------------------------------------------------------------------------------

    @invariant()
    def requests_are_carried_out_once_and_in_order(self) -> None:
        done = [message for _, message in self.peer.carried_out if isinstance(message, messages.SetParameter)]
        values = [message.value for message in done]
        assert values == sorted(set(values)), "twice, or out of order"
        numbers: dict[int, list[int]] = {}
        for session, message in self.peer.carried_out:
            numbers.setdefault(session, []).append(message.number)  # type: ignore[union-attr]
        for session, those in numbers.items():
            assert those == list(range(1, len(those) + 1)), f"numbers in session {session:x}"

    @invariant()
    def answers_are_true(self) -> None:
        done = {message.value for _, message in self.peer.carried_out if isinstance(message, messages.SetParameter)}
        for value, request in self.asked:
            if request.answer is not None:
                assert request.answer.value == value and value in done
            elif request.error is not None and "it was not done" in str(request.error):
                assert value not in done

    @invariant()
    def events_come_once_and_in_order(self) -> None:
        self.fetch()
        assert self.received == sorted(set(self.received))

    @invariant()
    def memory_is_bounded(self) -> None:
        link = self.link
        assert (
            len(link.telemetry.waiting) <= link.telemetry.ROOM
            and len(link.clock._waiting) <= 64
            and len(link.events.waiting) <= Events.ROOM
        )
        assert len(self.peer._events) <= QUEUE + len(messages.EventKind)
        assert all(len(polygon) < 64 for polygon in link.clock.estimate._polygons)

    def teardown(self) -> None:
        """Once the line works, everything flows within a second."""
        self.session.channel = Channel()
        self.listen(0.6)  # copies of earlier times are still under way
        self.listen(PATIENCE_S if not self.link.session.is_open else RESUME_S)
        assert self.link.session.is_open
        assert self.link.session.hello is not None and self.peer.session == self.link.session.hello.session
        sessions = self.link.counts.sessions
        self.value += 1
        assert self.link.request(messages.SetParameter, VALUES.id, self.value, what="set").value == self.value
        self.something_happens_on_the_board()
        self.link.telemetry.fetch()
        self.listen(0.5, fetch=False)
        assert len(self.link.telemetry.fetch()) >= 48
        self.fetch()
        assert self.received[-1] == self.happened
        assert self.link.counts.sessions == sessions, "and stays so"
        self.peer.reset()
        self.listen(RESUME_S)
        assert self.link.session.is_open and self.link.telemetry.latest is not None

    # ---- how ---------------------------------------------------------------------------------------------------------

    def listen(self, seconds: float, fetch: bool = True) -> None:
        end = self.session.now() + seconds
        while self.session.now() < end - 1e-9:
            try:
                self.link._turn(end)
            except TakenOverError:
                raise AssertionError("there is no other host") from None
            if fetch:
                self.fetch()

    def fetch(self) -> None:
        kind = messages.EventKind.DEAD_MAN
        self.received += [event.value for event in self.link.events.fetch() if event.kind == kind]


LINES = settings(stateful_step_count=25)  # as many examples as the profile says


def test_link_keeps_its_promises() -> None:
    run_state_machine_as_test(LinkModel, settings=LINES)


@pytest.mark.soak
@pytest.mark.parametrize("missing", ["numbers", "nonce"])
def test_model_notices_a_board_without_a_protection(missing: str) -> None:
    """What the protections are good for, and that the model above would notice."""

    class Unprotected(LinkModel):
        protections = without(**{missing: False})

    with pytest.raises((AssertionError, BoardError)):
        run_state_machine_as_test(Unprotected, settings=settings(LINES, max_examples=300, phases=[Phase.generate]))
