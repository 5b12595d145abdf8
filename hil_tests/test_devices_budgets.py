"""Every task of tasks.def within its budget on the AVR, with all devices on: cycles of the task itself.

The image gets a probe around each task that keeps interrupts off meanwhile, so that none is counted; so it is no image
for exact edges, and the line is quiet.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from boebot.link import messages
from hil_tests.device_bench import Capacitor, DeviceBench, DeviceRig, TwoWireDevice
from sim_bridge.boards import avr
from sim_bridge.tests.symbols import find_symbol
from tools.bench.avr_program import build
from tools.timing_table import fullest_slot, read_table

pytestmark = pytest.mark.emulated

TABLE = read_table()
ENVIRONMENTS = {"shieldbot": "env:uno", "boebot": "env:uno_boebot"}
MAIN = """
#include "firmware.h"
#include "hal/hal.h"
volatile uint16_t most[TASKS];
#define PROBE(number, name)                                   \\
  void __real_##name##_task(void);                            \\
  void __wrap_##name##_task(void);                            \\
  void __wrap_##name##_task(void) {                           \\
    HAL_ATOMIC {                                              \\
      const uint16_t before = TCNT1;                          \\
      __real_##name##_task();                                 \\
      const uint16_t took = (uint16_t)(TCNT1 - before);       \\
      if (took > most[number]) { most[number] = took; }       \\
    }                                                         \\
  }
PROBES
int main(void) {
  firmware_start();
  for (;;) {
    firmware_poll();
    hal_sleep_until(firmware_due);
  }
}
"""


def worst_cycles(folder: Path, pin_map: str) -> dict[str, int]:
    """The most cycles that each task took in 1.5 s with everything on."""
    names = [task.name for task in TABLE.tasks]
    probes = "\n".join(f"PROBE({i}, {name})" for i, name in enumerate(names))
    source, image = folder / "budgets.c", folder / "budgets.elf"
    source.write_text(MAIN.replace("PROBES", probes).replace("TASKS", str(len(names))), encoding="ascii")
    wraps = tuple(f"-Wl,--wrap={name}_task" for name in names)
    build(image, source, ("-w", *wraps), ENVIRONMENTS[pin_map])
    bench = DeviceBench("native", pin_map)
    bench.access = bench.board = avr.create(image).access()
    with DeviceRig("native", pin_map, bench) as rig:
        access = bench.access
        compass = TwoWireDevice(access, 0x1E)
        bench.devices += [compass, Capacitor(access, 15, 2000.0), Capacitor(access, 6, 3000.0)]
        rig.start()
        built = sum(int(bit) for bit, name in messages.DEVICE_OF_BIT.items() if name in rig.bench.robot.device)
        rig.set("devices", built)
        rig.set("infrared_sweep", 1)
        rig.send(messages.Buzzer(2000, 30, 1))
        rig.send(messages.Turret(3000, 1))
        rig.drive_for(0.2, 0.3, 0.1)
        compass.holds = True
        rig.listen(0.1)
        compass.holds = False
        rig.listen(0.05)
        bench.devices.clear()
        rig.listen(0.3)  # a dead-man stop
        rig.request(messages.SaveParameters, within_s=0.6)
        rig.listen(0.4)
        symbol = find_symbol(image, "most")
        words = access.read_memory(symbol.address, symbol.size)
    return {name: int.from_bytes(words[2 * i : 2 * i + 2], "little") for i, name in enumerate(names)}


@pytest.mark.parametrize("pin_map", ENVIRONMENTS)
def test_each_task_keeps_its_budget(tmp_path: Path, pin_map: str) -> None:
    worst = worst_cycles(tmp_path, pin_map)
    print("\n" + "\n".join(f"{pin_map:10} {t.name:10} {worst[t.name]:6} of {t.budget:6}" for t in TABLE.tasks))
    assert all(worst.values()), "a task has not run"
    over = {task.name: (worst[task.name], task.budget) for task in TABLE.tasks if worst[task.name] > task.budget}
    assert not over


def test_budgets_of_the_fullest_slot_leave_half_of_it() -> None:
    """Interrupts of a saturated line take the other half at most (ANCHORS, section 5)."""
    assert fullest_slot(TABLE) <= 20_000
