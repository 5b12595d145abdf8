/* avr_image.c: puts the program of an ELF file into flash and EEPROM.
 *
 * Reads the little of ELF32 that an AVR image has: the header and its loadable segments, whose physical addresses say
 * where they go: flash from 0, EEPROM from 0x810000; fuses and lock bits from 0x820000 are not needed. A program that begins
 * in the boot section has its reset there (the fuse BOOTRST, 27.6). Segments also say where the code ends, and where the variables do (their addresses are those of data memory and 0x800000).
 *
 * SPDX-License-Identifier: GPL-3.0-or-later (linked with simavr)
 */
#include <stdio.h>
#include <string.h>

#include "avr_board.h"
#include "avr_parts.h"

#define ELF_HEADER_SIZE 52u
#define SEGMENT_HEADER_SIZE 32u
#define SEGMENT_LOAD 1u
#define SEGMENT_EXECUTABLE 1u
#define DATA_BASE 0x800000u
#define EEPROM_BASE 0x810000u

static uint32_t half(const uint8_t *p) { return p[0] | (uint32_t)p[1] << 8; }
static uint32_t word(const uint8_t *p) { return half(p) | half(p + 2) << 16; }

/* Copies one segment; false if it does not fit. */
static bool load_segment(avr_board *b, const uint8_t *bytes, uint32_t address, uint32_t size) {
  if (address < AVR_BOARD_FLASH_SIZE) {
    if (size > AVR_BOARD_FLASH_SIZE - address) return false;
    memcpy(b->avr->flash + address, bytes, size);
  } else if (address >= EEPROM_BASE && address < EEPROM_BASE + BOARD_EEPROM_SIZE) {
    if (size > EEPROM_BASE + BOARD_EEPROM_SIZE - address) return false;
    memcpy(b->eeprom.cells + (address - EEPROM_BASE), bytes, size);
  } else if (address < EEPROM_BASE) {
    return false;
  }
  return true;
}

/* What a segment says of the program: where its code ends, or its variables, if they leave memory for a stack. */
static void heed_segment(avr_board *b, const uint8_t *segment) {
  uint32_t place = word(segment + 8), address = word(segment + 12), length = word(segment + 16);
  uint32_t size = word(segment + 20), flags = word(segment + 24);
  if ((flags & SEGMENT_EXECUTABLE) && address < AVR_BOARD_FLASH_SIZE && address + length > b->code_end) {
    b->code_end = address + length;
  }
  uint32_t begin = place - DATA_BASE;
  if (begin < BOARD_DATA_SIZE && size < BOARD_DATA_SIZE - begin && begin + size > b->variables_end) {
    b->variables_end = (uint16_t)(begin + size);
  }
}

bool image_load(avr_board *b, const uint8_t *elf, size_t size, char *error, size_t error_size) {
  if (size < ELF_HEADER_SIZE) {
    snprintf(error, error_size, "it is cut short");
    return false;
  }
  uint32_t table = word(elf + 28), entry_size = half(elf + 42), entries = half(elf + 44);
  bool loaded = false;
  b->variables_end = RAM_BEGIN;
  for (uint32_t i = 0; i < entries; i++) {
    uint64_t at = table + (uint64_t)i * entry_size;
    if (entry_size < SEGMENT_HEADER_SIZE || at + SEGMENT_HEADER_SIZE > size) {
      snprintf(error, error_size, "its segment table is damaged");
      return false;
    }
    const uint8_t *segment = elf + at;
    uint32_t offset = word(segment + 4), address = word(segment + 12), length = word(segment + 16);
    if (word(segment) != SEGMENT_LOAD) continue;
    heed_segment(b, segment);
    if (length == 0) continue;
    if ((uint64_t)offset + length > size) {
      snprintf(error, error_size, "it is cut short");
      return false;
    }
    if (!load_segment(b, elf + offset, address, length)) {
      snprintf(error, error_size, "its %lu bytes at address 0x%lX do not fit into an ATmega328P", (unsigned long)length,
               (unsigned long)address);
      return false;
    }
    loaded = loaded || address < AVR_BOARD_FLASH_SIZE;
  }
  loaded = loaded && b->code_end > 0;
  const uint32_t begin = word(elf + 24);
  if (begin >= BOOT_BEGIN && begin < b->code_end) {
    b->avr->reset_pc = begin;
  } else {
    b->code_begin = 1; /* address 0 is for resets: a jump there is noticed */
  }
  if (!loaded) snprintf(error, error_size, "it holds no program");
  return loaded;
}
