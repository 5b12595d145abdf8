"""What CAN costs: the bus's load, and a round trip by the mirror."""

from __future__ import annotations

import contextlib
import json
import logging
import socket
import statistics
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from functools import cache

import can

from boebot.link import messages
from boebot.link.frame import Decoder, encode
from boebot.running.tasks import Request
from boebot_can.frames import CanFrame, FrameMaker
from boebot_can.load import DEFAULT_BITRATE, frame_bits
from boebot_can.log import frames_of
from tools.tests.bench.figures import Peer, figure, ran

SECONDS = 20.0
PROBES = 1000
SESSION = 0x12345

logging.getLogger("can").addHandler(logging.NullHandler())  # else its remarks go to standard error


@cache
def run_frames() -> list[tuple[float, CanFrame]]:
    """All frames of a run."""
    result = ran(Request.single("wander", arena="room", on="native", seconds=SECONDS))
    return [(sent.time_s, sent.frame) for sent in frames_of(result)]


def load(wanted: Callable[[CanFrame], bool]) -> float:
    """Share of a bus of 500 kbit/s that those frames take, in per cent."""
    frames = run_frames()
    bits = sum(frame_bits(frame) for _, frame in frames if wanted(frame))
    return 100 * bits / (DEFAULT_BITRATE * (frames[-1][0] - frames[0][0]))


@figure("CAN: telemetry at 100 Hz, share of 500 kbit/s, stuffed bits counted", "%", at_most=20)
def telemetry_load() -> float:
    return load(lambda frame: frame.identifier >> 8 == 3)


@figure("CAN: the same with all other messages of a run, brain's period 50 ms", "%")
def whole_load() -> float:
    return load(lambda frame: True)


# ---- the mirror ------------------------------------------------------------------------------------------------------


@contextlib.contextmanager
def answering() -> Iterator[int]:
    """Somebody on a TCP port who says hello once and answers each clock probe at once; gives the port."""
    hello = messages.Hello(messages.PROTOCOL_VERSION, messages.SCHEMA_HASH, 1, SESSION, 100, 1000, 1, 1, 0, 0, 0, b"")
    with socket.create_server(("127.0.0.1", 0)) as server:

        def answer() -> None:
            with contextlib.suppress(OSError):
                while True:
                    connection, _ = server.accept()
                    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                    connection.sendall(encode(messages.Hello.ID, 0, hello.pack()))
                    decoder = Decoder(SESSION, to_board=True)
                    while data := connection.recv(4096):
                        for number, _, payload in decoder.feed(data):
                            if number == messages.ClockProbe.ID:
                                told = messages.ClockAnswer(messages.ClockProbe.unpack(payload).token, 0)
                                connection.sendall(encode(told.ID, 0, told.pack(), SESSION))

        threading.Thread(target=answer, daemon=True).start()
        yield server.getsockname()[1]
        server.shutdown(socket.SHUT_RDWR)


def round_trips(ask: Callable[[int], None], answered: Callable[[], bool]) -> float:
    """Median of the round trips (ms)."""
    taken = []
    for token in range(PROBES):
        begun = time.perf_counter()
        ask(token)
        while not answered():
            pass
        taken.append(1000 * (time.perf_counter() - begun))
        time.sleep(0.0007)  # the bridge is at another place of its turn each time
    return statistics.median(taken)


def direct(port: int) -> float:
    """Without a mirror."""
    decoder = Decoder(SESSION)
    with socket.create_connection(("127.0.0.1", port)) as connection:
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return round_trips(
            lambda token: connection.sendall(
                encode(messages.ClockProbe.ID, 0, messages.ClockProbe(token).pack(), SESSION)
            ),
            lambda: any(number == messages.ClockAnswer.ID for number, _, _ in decoder.feed(connection.recv(4096))),
        )


def mirrored(port: int) -> float:
    """Through `boebot can bridge` in a process of its own, and python-can's client."""
    command = [
        sys.executable,
        "-m",
        "boebot",
        "can",
        "bridge",
        f"socket://127.0.0.1:{port}",
        "--socketcand",
        "0",
        "--json",
    ]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as bridge:
        assert bridge.stdout is not None
        try:
            bus_port = int(json.loads(bridge.stdout.readline())["url"].rpartition("=")[2])
            with can.Bus(interface="socketcand", channel="can0", host="127.0.0.1", port=bus_port, tcp_tune=True) as bus:
                time.sleep(0.2)
                maker = FrameMaker(1)

                def ask(token: int) -> None:
                    payload = messages.ClockProbe(token).pack()
                    (frame,) = maker.frames(messages.ClockProbe.ID, payload, SESSION, 0)
                    bus.send(can.Message(arbitration_id=frame.identifier, data=frame.data, is_extended_id=False))

                def answered() -> bool:
                    message = bus.recv(1.0)
                    return message is not None and message.arbitration_id == 0x227

                return round_trips(ask, answered)
        finally:
            bridge.terminate()


def without() -> float:
    """The same without a mirror."""
    with answering() as port:
        return direct(port)


@figure(
    "CAN: a round trip by the mirror, both ways, through socketcand (p50)",
    "ms",
    times_at_most=20,
    peers=[Peer("without it", without)],
)
def by_mirror() -> float:
    with answering() as port:
        return mirrored(port)
