/* Parameters: ranges and answers. */
#include <doctest.h>

#include <vector>

#include "../native_bench.h"
#include "link/parameters.h"

namespace {

struct range {
  uint8_t id;
  int32_t minimum, maximum, initial;
};

#define RANGE(name, id, minimum, maximum, initial) {id, minimum, maximum, initial},
const std::vector<range> RANGES = {PARAMETER_LIST(RANGE)};
#undef RANGE

/* Asks the running firmware for a parameter, or to set it. */
msg_parameter ask(native_bench &bench, uint8_t id, const void *payload, uint8_t length) {
  bench.messages.clear();
  bench.send(id, payload, length);
  bench.run(2 * MILLISECOND);
  return bench.last(MSG_PARAMETER_ID).as<msg_parameter>();
}

msg_parameter get(native_bench &bench, uint8_t parameter) { return ask(bench, MSG_GET_PARAMETER_ID, &parameter, 1); }

msg_parameter set(native_bench &bench, uint8_t parameter, int32_t value) {
  const msg_set_parameter request{parameter, value};
  return ask(bench, MSG_SET_PARAMETER_ID, &request, sizeof request);
}

}  // namespace

TEST_CASE("every parameter starts at its default") {
  native_bench bench;
  REQUIRE(RANGES.size() == PARAMETER_COUNT);
  for (const range &r : RANGES) {
    const msg_parameter answer = get(bench, r.id);
    CHECK(answer.parameter == r.id);
    CHECK(answer.value == r.initial);
    CHECK(answer.status == PARAMETER_STATUS_OK);
  }
}

TEST_CASE("the ends of a range are in it, the next values are not") {
  native_bench bench;
  for (const range &r : RANGES) {
    if (r.id == PARAMETER_DEVICES) {
      continue; /* below: only built devices */
    }
    CAPTURE(r.id);
    for (int32_t value : {r.minimum, r.maximum}) {
      CHECK(set(bench, r.id, value).status == PARAMETER_STATUS_OK);
      CHECK(get(bench, r.id).value == value);
    }
    for (int32_t value : {r.minimum - 1, r.maximum + 1, INT32_MIN, INT32_MAX}) {
      const msg_parameter answer = set(bench, r.id, value);
      CHECK(answer.status == PARAMETER_STATUS_OUT_OF_RANGE);
      CHECK(answer.value == r.maximum);
    }
  }
}

TEST_CASE("only devices that are built can be switched on") {
  native_bench bench;
  CHECK(set(bench, PARAMETER_DEVICES, static_cast<int32_t>(PARAMETERS_DEVICES_BUILT)).status == PARAMETER_STATUS_OK);
  CHECK(set(bench, PARAMETER_DEVICES, 0).status == PARAMETER_STATUS_OK);
  CHECK(set(bench, PARAMETER_DEVICES, static_cast<int32_t>(DEVICES_COMPASS)).status == PARAMETER_STATUS_OUT_OF_RANGE);
  CHECK(get(bench, PARAMETER_DEVICES).value == 0);
}

TEST_CASE("a number that is no parameter is answered so") {
  native_bench bench;
  for (uint8_t id : {static_cast<uint8_t>(PARAMETER_COUNT), static_cast<uint8_t>(255)}) {
    CHECK(get(bench, id).status == PARAMETER_STATUS_UNKNOWN_PARAMETER);
    CHECK(set(bench, id, 1).status == PARAMETER_STATUS_UNKNOWN_PARAMETER);
    CHECK(get(bench, id).value == 0);
  }
}

TEST_CASE("a reset brings the defaults back") {
  {
    native_bench bench;
    set(bench, PARAMETER_INFRARED_PERIOD, 17);
    REQUIRE(get(bench, PARAMETER_INFRARED_PERIOD).value == 17);
  }
  native_bench bench;
  CHECK(get(bench, PARAMETER_INFRARED_PERIOD).value == DEFAULT_INFRARED_PERIOD);
}
