/* storage.h: what outlives the power, in the EEPROM: the parameters, and how often this board was started.
 *
 * Nothing waits for a cell (3.4 ms each): storage_task() writes a record cell by cell, one every other slot, and reads each
 * back. All parameters are kept twice. A save writes the copy that is not in force, which is marked void first
 * and valid last; so whenever the power goes, and whatever it leaves of the cell under way, one copy is whole.
 *
 *   address  size
 *   0x000    128   nothing: address 0 is the cell that suffers when the supply fails (data sheet, 8.4.2)
 *   0x080    128   parameters, copy 0      mark, generation, hash of the table (2), values (2 each), CRC-16
 *   0x100    128   boot counter, 16 slots in turn, 8 bytes each      mark, count (4), CRC-16, spare
 *   0x180    128   parameters, copy 1
 */
#ifndef STORAGE_H
#define STORAGE_H

#include <stdbool.h>
#include <stdint.h>

/* Reads the boot counter. At start, before interrupts. */
void storage_start(void);

/* Puts the saved parameters in force, if there is a whole copy of this image's parameters and all are within their ranges.
 * At start, after parameters_start(). */
void storage_load_parameters(void);

/* Whether the parameters in force at start were those that were saved. */
bool storage_parameters_loaded(void);

/* Begins to save all parameters as they are now; a save under way is finished first. Returns ANSWER_STATUS_OK, or
 * ANSWER_STATUS_SUPPLY_LOW and does nothing. */
uint8_t storage_save(void);

/* Whether a save is under way. */
bool storage_busy(void);

/* How the last save ended: ANSWER_STATUS_OK, written and read back; ANSWER_STATUS_STORAGE_FAILED, read back otherwise;
 * ANSWER_STATUS_SUPPLY_LOW, given up. Unless it is OK, what was saved before stays so. */
uint8_t storage_result(void);

/* Starts of this board that ran for 10 s, this one included. */
uint32_t storage_boot_counter(void);

#endif
