/* identity.c: see identity.h. */
#include "link/identity.h"

#include <string.h>

#include "clock.h"
#include "generated/messages.h"
#include "hal/hal.h"
#include "link/send.h"
#include "link/session_seed.h"
#include "link/telemetry.h"
#include "parameters.h"
#include "reset.h"
#include "storage.h"
#include "version.h"

#if defined(__AVR__)
#define COMPILER "avr-gcc " __VERSION__
#elif defined(__clang__)
#define COMPILER "clang " __clang_version__
#else
#define COMPILER "gcc " __VERSION__
#endif

static uint32_t image_hash;

HAL_TABLE char compiler[] = COMPILER;
HAL_TABLE char firmware_version[] = FIRMWARE_VERSION;
HAL_TABLE char pin_map[] = PIN_MAP_NAME;
HAL_TABLE char robot[] = ROBOT_NAME;
_Static_assert(sizeof pin_map <= sizeof((msg_identity *)0)->pin_map + 1, "the pin map's name fits");
_Static_assert(sizeof robot <= sizeof((msg_hello *)0)->robot + 1, "the robot's name fits");
_Static_assert(sizeof firmware_version <= sizeof((msg_identity *)0)->firmware_version + 1, "the version fits");

typedef struct {
  uint8_t id, length;
  uint32_t hash;
} known_message;

#define KNOWN(id, length, hash) {(id), (length), (hash)},
HAL_TABLE known_message known[MESSAGE_COUNT] = {MESSAGE_LIST(KNOWN)};
#undef KNOWN

/* Copies a text of `size` bytes with its NUL into a field that is already zero, cut to the field. */
static void put_text(char *field, uint8_t room, const char *text, uint8_t size) {
  hal_table_copy(field, text, size < room ? size : room);
}

void identity_start(void) { image_hash = hal_image_hash(); }

bool identity_send_hello(void) {
  msg_hello hello = {
      .protocol_version = PROTOCOL_VERSION,
      .schema_hash = SCHEMA_HASH,
      .board_nonce = session_board_nonce(),
      .session = session_is_open() ? session_seed() : 0u,
      .tick_rate = CLOCK_TICK_RATE,
      .session_time_out = parameters_u16(PARAMETER_SESSION_TIME_OUT),
      .telemetry_period = telemetry_period(),
      .boot_counter = storage_boot_counter(),
      .reset_cause = reset_cause(),
      .parameters_saved = storage_parameters_loaded(),
      .devices = parameters_devices(),
  };
  put_text(hello.robot, sizeof hello.robot, robot, sizeof robot);
  return send_message(MSG_HELLO_ID, &hello, sizeof hello);
}

bool identity_send(void) {
  msg_identity identity = {.image_size = hal_image_size(), .image_hash = image_hash};
  put_text(identity.firmware_version, sizeof identity.firmware_version, firmware_version, sizeof firmware_version);
  put_text(identity.compiler, sizeof identity.compiler, compiler, sizeof compiler);
  put_text(identity.pin_map, sizeof identity.pin_map, pin_map, sizeof pin_map);
  return send_message(MSG_IDENTITY_ID, &identity, sizeof identity);
}

bool identity_describe(uint8_t index) {
  known_message found = {0};
  if (index < MESSAGE_COUNT) {
    hal_table_copy(&found, &known[index], sizeof found);
  }
  const msg_description description = {
      .index = index, .count = MESSAGE_COUNT, .id = found.id, .length = found.length, .hash = found.hash};
  return send_message(MSG_DESCRIPTION_ID, &description, sizeof description);
}
