/* identity.c: see identity.h. */
#include "link/identity.h"

#include <string.h>

#include "firmware.h"
#include "generated/messages.h"
#include "hal/hal.h"
#include "link/parameters.h"
#include "link/send.h"
#include "pins.h"
#include "schedule.h"

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
_Static_assert(sizeof pin_map <= sizeof((msg_hello *)0)->pin_map + 1, "the pin map's name fits");
_Static_assert(sizeof firmware_version <= sizeof((msg_identity *)0)->firmware_version + 1, "the version fits");

/* Copies a text of `size` bytes with its NUL into a field that is already zero, cut to the field. */
static void put_text(char *field, uint8_t room, const char *text, uint8_t size) {
  hal_table_copy(field, text, size < room ? size : room);
}

void identity_start(void) { image_hash = hal_image_hash(); }

void identity_send_hello(void) {
  msg_hello hello = {
      .protocol_version = PROTOCOL_VERSION,
      .schema_hash = SCHEMA_HASH,
      .tick_rate = SCHEDULE_TICK_RATE,
      .devices = (uint32_t)parameters_get(PARAMETER_DEVICES),
      .reset_cause = hal_reset_cause(),
  };
  put_text(hello.pin_map, sizeof hello.pin_map, pin_map, sizeof pin_map);
  send_message(MSG_HELLO_ID, &hello, sizeof hello);
}

void identity_send(void) {
  msg_identity identity = {.image_size = hal_image_size(), .image_hash = image_hash};
  put_text(identity.firmware_version, sizeof identity.firmware_version, firmware_version, sizeof firmware_version);
  put_text(identity.compiler, sizeof identity.compiler, compiler, sizeof compiler);
  send_message(MSG_IDENTITY_ID, &identity, sizeof identity);
}
