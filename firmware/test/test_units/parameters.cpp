/* Parameters: types, ranges and what is refused. */
#include <doctest.h>

#include <string>
#include <vector>

#include "memory_bench.h"
extern "C" {
#include "parameters.h"
}
#include "pins.h"

namespace {

struct range {
  uint8_t id;
  bool is_signed;
  int32_t minimum, maximum, initial;
};

#define RANGE(name, type, minimum, maximum, initial) \
  {PARAMETER_##name, std::string(#type) == "i16", minimum, maximum, initial},
const std::vector<range> RANGES = {PARAMETER_LIST(RANGE)};
#undef RANGE

const std::vector<int32_t> RATES = {96, 192, 384, 576, 1152, 2500, 5000, 10000};

std::vector<int32_t> all() {
  std::vector<int32_t> values;
  for (uint8_t id = 0; id < PARAMETER_COUNT; id++) {
    values.push_back(parameters_get(id));
  }
  return values;
}

struct started {
  memory_bench bench;
  started() { bench.power_on(); }
};

}  // namespace

TEST_CASE_FIXTURE(started, "every parameter starts at its default") {
  REQUIRE(RANGES.size() == PARAMETER_COUNT);
  for (const range &r : RANGES) {
    CAPTURE(r.id);
    CHECK(parameters_get(r.id) == r.initial);
  }
}

TEST_CASE_FIXTURE(started, "the ends of a range are in it, the next values are not") {
  for (const range &r : RANGES) {
    if (r.id == PARAMETER_DEVICES) {
      continue; /* below: only built devices */
    }
    CAPTURE(r.id);
    for (int32_t value : {r.minimum, r.maximum}) {
      CHECK(parameters_set(r.id, value) == ANSWER_STATUS_OK);
      CHECK(parameters_get(r.id) == value);
      CHECK((r.is_signed ? parameters_i16(r.id) : parameters_u16(r.id)) == value);
    }
    for (int32_t value : {r.minimum - 1, r.maximum + 1, r.minimum + 65536, r.maximum - 65536, INT32_MIN, INT32_MAX}) {
      CHECK(parameters_set(r.id, value) == ANSWER_STATUS_OUT_OF_RANGE);
      CHECK(parameters_get(r.id) == r.maximum);
    }
  }
}

TEST_CASE_FIXTURE(started, "setting one parameter leaves the others alone") {
  for (const range &r : RANGES) {
    parameters_reset();
    std::vector<int32_t> expected = all();
    expected[r.id] = r.id == PARAMETER_DEVICES ? 0 : r.minimum;
    CHECK(parameters_set(r.id, expected[r.id]) == ANSWER_STATUS_OK);
    CHECK(all() == expected);
  }
}

TEST_CASE_FIXTURE(started, "only devices that the pin map has can be switched on") {
  CHECK(parameters_set(PARAMETER_DEVICES, DEVICES_BUILT) == ANSWER_STATUS_OK);
  CHECK(parameters_device_on(DEVICES_PING));
  CHECK(parameters_set(PARAMETER_DEVICES, 0) == ANSWER_STATUS_OK);
  CHECK_FALSE(parameters_device_on(DEVICES_PING));
  CHECK(parameters_set(PARAMETER_DEVICES, DEVICES_ANALOG_INFRARED) == ANSWER_STATUS_OUT_OF_RANGE);
  CHECK(parameters_get(PARAMETER_DEVICES) == 0);
}

TEST_CASE_FIXTURE(started, "the line has eight rates and no other") {
  size_t allowed = 0;
  for (int32_t rate = 0; rate <= 11000; rate++) {
    allowed += parameters_set(PARAMETER_BAUD_RATE, rate) == ANSWER_STATUS_OK;
  }
  CHECK(allowed == RATES.size());
  for (int32_t rate : RATES) {
    CHECK(parameters_set(PARAMETER_BAUD_RATE, rate) == ANSWER_STATUS_OK);
    CHECK(parameters_u16(PARAMETER_BAUD_RATE) == rate);
  }
}

TEST_CASE_FIXTURE(started, "a number that is no parameter is reported") {
  const std::vector<int32_t> before = all();
  for (int id = PARAMETER_COUNT; id < 256; id++) {
    CHECK(parameters_set(static_cast<uint8_t>(id), 1) == ANSWER_STATUS_UNKNOWN_PARAMETER);
    CHECK(parameters_get(static_cast<uint8_t>(id)) == 0);
  }
  CHECK(all() == before);
}

TEST_CASE_FIXTURE(started, "the defaults come back when asked for, and at a reset") {
  const std::vector<int32_t> defaults = all();
  for (bool by_reset : {false, true}) {
    REQUIRE(parameters_set(PARAMETER_INFRARED_PERIOD, 17) == ANSWER_STATUS_OK);
    REQUIRE(all() != defaults);
    if (by_reset) {
      bench.reset(RESET_CAUSE_EXTERNAL);
    } else {
      parameters_reset();
    }
    CHECK(all() == defaults);
  }
}

TEST_CASE_FIXTURE(started, "kept values are used all or not at all") {
  const std::vector<int32_t> defaults = all();
  std::vector<uint16_t> kept(parameters_values(), parameters_values() + PARAMETER_COUNT);
  kept[PARAMETER_INFRARED_PERIOD] = 17;
  kept[PARAMETER_SERVO_LEFT_GAIN] = static_cast<uint16_t>(-3200);
  for (const range &r : RANGES) {
    if (r.maximum == UINT16_MAX) {
      continue; /* every value is in its range */
    }
    std::vector<uint16_t> wrong = kept;
    wrong[r.id] = static_cast<uint16_t>(r.maximum + 1);
    CAPTURE(r.id);
    CHECK_FALSE(parameters_restore(wrong.data()));
    CHECK(all() == defaults);
  }
  CHECK(parameters_restore(kept.data()));
  CHECK(parameters_get(PARAMETER_INFRARED_PERIOD) == 17);
  CHECK(parameters_get(PARAMETER_SERVO_LEFT_GAIN) == -3200);
}
