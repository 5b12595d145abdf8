"""What CAN costs: the bus's load, what the mirror adds to a round trip, a flood, and frames beside cantools'."""

from __future__ import annotations

import contextlib
import json
import logging
import random
import socket
import statistics
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from functools import cache
from typing import Any

import can
import cantools.database

from boebot.link import messages
from boebot.link.frame import Decoder, encode
from boebot.resources import folder
from boebot.running.loop import execute
from boebot.running.tasks import Request
from boebot_can.frames import Assembler, CanFrame, FrameMaker
from boebot_can.load import DEFAULT_BITRATE, frame_bits
from boebot_can.log import frames_of
from boebot_can.socketcand_server import SocketcandBus
from tools.bench.figures import Peer, figure

SECONDS = 20.0
PROBES = 1000
FLOOD = 20_000
SESSION = 0x12345
BATCH = 2000

logging.getLogger("can").addHandler(logging.NullHandler())  # else its remarks go to standard error


@cache
def run_frames() -> list[tuple[float, CanFrame]]:
    """All frames of a run."""
    result = execute(Request.single("wander", arena="room", on="native", seconds=SECONDS))
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


@figure("CAN: what the mirror adds to a round trip, both ways, through socketcand (p50)", "ms", at_most=1)
def mirror_adds() -> float:
    with answering() as port:
        without = direct(port)
    with answering() as port:
        return mirrored(port) - without


@figure("CAN: of 20,000 frames flooded through socketcand, neither received nor counted as dropped", "", at_most=0)
def flood() -> float:
    bus = SocketcandBus(0, time.monotonic)
    with (
        contextlib.closing(bus),
        contextlib.ExitStack() as stack,
    ):
        taken = 0
        done = threading.Event()

        def work() -> None:
            nonlocal taken
            while not done.is_set():
                taken += len(bus.receive(0.002))

        thread = threading.Thread(target=work)
        thread.start()
        stack.callback(thread.join)
        stack.callback(done.set)
        sender, receiver = (
            stack.enter_context(can.Bus(interface="socketcand", channel="can0", host="127.0.0.1", port=bus.port))
            for _ in range(2)
        )
        time.sleep(0.2)
        received = 0

        def fetch() -> None:
            nonlocal received
            while receiver.recv(1.0) is not None:
                received += 1

        fetching = threading.Thread(target=fetch)
        fetching.start()
        for number in range(FLOOD):
            sender.send(can.Message(arbitration_id=0x301, data=number.to_bytes(8, "little"), is_extended_id=False))
        fetching.join()
    return float(max(FLOOD - received - bus.dropped, FLOOD - taken))


# ---- frames ----------------------------------------------------------------------------------------------------------


@cache
def telemetries() -> list[bytes]:
    draw = random.Random("telemetry")
    return [draw.randbytes(messages.Telemetry.LENGTH) for _ in range(BATCH)]


@cache
def database() -> list[Any]:
    """cantools' messages for the frames of a telemetry."""
    loaded: Any = cantools.database.load_file(folder("protocol") / "boebot.dbc")
    return [message for message in loaded.messages if message.name.startswith("telemetry_")]


def rate(work: Callable[[], object]) -> float:
    begun = time.perf_counter()
    work()
    return BATCH / (time.perf_counter() - begun)


@cache
def frames() -> list[list[CanFrame]]:
    maker = FrameMaker(1)
    return [maker.frames(messages.Telemetry.ID, payload, SESSION, 0) for payload in telemetries()]


@cache
def signals() -> list[list[dict[str, Any]]]:
    """The same as values of signals, in counts: cantools need not scale."""
    decode: dict[str, Any] = {"decode_choices": False, "scaling": False}
    return [
        [message.decode(frame.data, **decode) for message, frame in zip(database(), one, strict=True)]
        for one in frames()
    ]


def decode_by_cantools() -> float:
    frames()
    decode: dict[str, Any] = {"decode_choices": False, "scaling": False}
    return rate(
        lambda: [
            [message.decode(frame.data, **decode) for message, frame in zip(database(), one, strict=True)]
            for one in frames()
        ]
    )


def encode_by_cantools() -> float:
    signals()
    return rate(
        lambda: [
            [message.encode(some, scaling=False, strict=False) for message, some in zip(database(), one, strict=True)]
            for one in signals()
        ]
    )


@figure("CAN: telemetry into seven frames", "1/s", peers=[Peer("cantools", encode_by_cantools)], rounds=3)
def encoding() -> float:
    maker = FrameMaker(1)
    telemetries()
    return rate(lambda: [maker.frames(messages.Telemetry.ID, payload, SESSION, 0) for payload in telemetries()])


@figure("CAN: seven frames into telemetry", "1/s", peers=[Peer("cantools", decode_by_cantools)], rounds=3)
def decoding() -> float:
    frames()
    assembler = Assembler(False, frozenset({1}))
    return rate(lambda: [assembler.add(frame) for one in frames() for frame in one])
