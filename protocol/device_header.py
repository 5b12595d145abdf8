"""Makes `generated/devices.h`: what follows for the firmware from the devices that messages.toml names.

A device is a pair of files `<device>.c` and `<device>.h` with `<device>_start()`, its task (tasks.def) and, for each
message that it speaks in, `<device>_report_<message>()`. Which devices an image has says its pin map.
"""

from __future__ import annotations

from collections.abc import Callable

import schema


def devices_header(spec: schema.Schema) -> str:
    """The header's text."""
    bits = spec.flags["devices"].bits
    spoken = [message for message in spec.message if message.devices]
    others = [message for message in spoken if message.name != "telemetry"]
    names = sorted({name for message in spoken for name in message.devices} | set(bits))
    lines = ["", *(f'#include "{name}.h"' for name in names)]
    lines += [
        '#include "clock.h"',
        '#include "generated/messages.h"',
        '#include "link/send.h"',
        '#include "pins.h"',
        "",
    ]
    for message in spoken:
        lines += [f"#define BUILDS_{message.name.upper()} ({_built(message, bits)})"]
    lines += [
        "",
        "/* All of them, before anything is known of the parameters. */",
        "static inline void devices_start(void) {",
    ]
    for bit in bits:
        wanted = [f"BUILDS_{message.name.upper()}" for message in spoken if bit in message.devices]
        lines += [f"#if {' || '.join(wanted) or 1}", f"  {bit}_start();", "#endif"]
    lines += ["}"]
    for message in spoken:
        lines += _report(message)
    lines += [
        "",
        "/* Messages of devices besides telemetry: how many there are, */",
        f"#define DEVICE_MESSAGES ({_sum(others)})",
    ]
    lines += [
        "",
        "/* how long the payload of one is, */",
        "static inline uint8_t device_message_length(uint8_t number) {",
    ]
    lines += _switch(others, lambda m: f"return MSG_{m.name.upper()}_LENGTH;", "return 0;")
    for message in others:
        lines += _sender(message)
    lines += ["", "/* and sends it, if one of its devices has something to say. */"]
    lines += ["static inline bool device_message_send(uint8_t number) {"]
    lines += _switch(others, lambda m: f"return send_{m.name}();", "return false;")
    doc = "the devices of this image, from protocol/messages.toml and the pin map."
    return schema.c_header("devices.h", doc, lines)


def _built(message: schema.Message, bits: list[str]) -> str:
    wanted = [f"DEVICES_{name.upper()}" for name in message.devices if name in bits]
    return f"(DEVICES_BUILT & ({' | '.join(wanted)})) != 0"


def _report(message: schema.Message) -> list[str]:
    """What all devices say in a message; besides telemetry, whether one has something to say."""
    calls = [f"{name}_report_{message.name}(message)" for name in message.devices]
    head = f"devices_report_{message.name}(msg_{message.name} *message) {{"
    guard = [f"#if BUILDS_{message.name.upper()}"]
    if message.name == "telemetry":
        return ["", f"static inline void {head}", *(f"  {call};" for call in calls), "}"]
    body = ["  bool any = false;", *(f"  any |= {call};" for call in calls), "  return any;"]
    return ["", *guard, f"static inline bool {head}", *body, "}", "#endif"]


def _sender(message: schema.Message) -> list[str]:
    """A function by itself, so that `boebot timing` sees that only one of them runs."""
    upper = message.name.upper()
    return [
        "",
        f"#if BUILDS_{upper}",
        f"static __attribute__((noinline)) bool send_{message.name}(void) {{",
        f"  msg_{message.name} message = {{.tick = clock_tick()}};",
        f"  return devices_report_{message.name}(&message) && send_message(MSG_{upper}_ID, &message, sizeof message);",
        "}",
        "#endif",
    ]


def _sum(messages: list[schema.Message]) -> str:
    """How many of these the image has."""
    return " + ".join(f"BUILDS_{message.name.upper()}" for message in messages) or "0"


def _switch(messages: list[schema.Message], body: Callable[[schema.Message], str], otherwise: str) -> list[str]:
    lines = ["  switch (number) {"]
    for number, message in enumerate(messages):
        lines += [f"#if BUILDS_{message.name.upper()}", f"    case {_sum(messages[:number])}:"]
        lines += [f"      {body(message)}", "#endif"]
    return [*lines, "    default:", f"      {otherwise}", "  }", "}"]
