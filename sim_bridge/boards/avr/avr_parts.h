/* avr_parts.h: what the files of the emulated ATmega328P know of each other.
 *
 * core/ has the CPU: it executes the instructions and keeps data memory and flash. Here is what has to do with time or
 * pins: run loop and interrupts (avr_run.c), registers (avr_registers.c), construction (avr_board.c), ports and edge detectors (avr_pins.c), timers (avr_timers.c,
 * avr_timer_count.c), USART (avr_usart.c), two-wire interface (avr_twi.c), SPI (avr_spi.c), ADC (avr_converter.c), watchdog (avr_watchdog.c),
 * EEPROM (avr_eeprom.c), self-programming (avr_flash.c), recorder (avr_spans.c), debugger (avr_debug.c), checks of the program (avr_checks.c).
 *
 * When something happens: avr_core.h. Each source of events has one due time; the core runs no further than the earliest
 * of them, so that every event happens at its own cycle, however long the instruction during which it falls and however
 * the run is cut into calls.
 */
#ifndef AVR_PARTS_H
#define AVR_PARTS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "board.h"
#include "core/avr_core.h"
#include "queue.h"

#define NEVER UINT64_MAX
#define NO_ADDRESS UINT32_MAX

/* From an edge at a pin to the flag or the capture that it causes: synchronizer and edge detector, 2.5 to 3.5 cycles
 * (13.2.1, 17.3). */
#define INPUT_LATENCY_CYCLES 3u

/* An interrupt flag in `raised` and `enabled`. */
#define FLAG(vector) (UINT32_C(1) << (vector))

/* Where the events come from; of two at the same cycle the first listed happens first. */
typedef enum {
  DUE_DRIVEN_EDGE,  /* the outside changes what it drives */
  DUE_SEEN_EDGE,    /* an edge has passed the synchronizer */
  DUE_NOISE_FILTER, /* the capture pin was steady for four samples */
  DUE_TIMER0,
  DUE_TIMER1,
  DUE_TIMER2,
  DUE_TRANSMITTER,
  DUE_BIT,     /* of the transmitter, at its pin */
  DUE_OUTSIDE, /* has read a byte */
  DUE_RECEIVER,
  DUE_CONVERTER,
  DUE_WATCHDOG,
  DUE_EEPROM,
  DUE_TWI,
  DUE_SPI,
  DUE_FLASH,
  DUE_COUNT
} due_source;

/* ---- ports and edges ---- */

enum { PORT_B, PORT_C, PORT_D, PORT_COUNT };

typedef struct {
  /* what the outside does */
  uint8_t driven;       /* bits that the outside drives */
  uint8_t driven_level; /* to this */
  /* what other units do with pins of this port */
  uint8_t forced; /* outputs that a timer or the transmitter has taken over */
  uint8_t forced_level;
  uint8_t forced_out; /* outputs whatever DDR says */
  uint8_t forced_in;  /* inputs whatever DDR says */
  uint8_t shifted;    /* outputs that the SPI drives: high if it or a timer says so (table 14-3) */
  uint8_t shifted_level;
  /* what follows */
  uint8_t out; /* bits that are outputs */
  uint8_t out_level;
  uint8_t pulled;       /* inputs with pull-up */
  uint8_t level;        /* at the pins */
  uint8_t level_before; /* before the change at `changed` */
  uint64_t changed;
} port_state;

typedef struct {
  uint64_t at;
  uint8_t pin; /* Arduino's number, or bit of a port */
  uint8_t level;
  uint8_t port;
} pin_change;

/* A queue of changes in the order of their times. */
typedef struct {
  pin_change *items;
  size_t first;
  size_t end;
  size_t capacity;
} change_queue;

/* ---- timers ---- */

#define TIMER0_CLOCK_BIT 4u /* T0 in port D; T1 is the next one */

typedef enum {
  COUNT_NORMAL,
  COUNT_CLEAR_ON_MATCH,
  COUNT_FAST_PWM,
  COUNT_PHASE_PWM,
  COUNT_PHASE_FREQUENCY_PWM
} count_mode;
#define NO_CLOCK 0xFFu

typedef enum { TOP_FIXED, TOP_OCRA, TOP_ICR } top_source;

typedef struct {
  struct avr_board *owner;
  /* what is built into this timer */
  uint8_t number;
  uint8_t address_control_a, address_count, address_compare[2];
  uint8_t vector_overflow, vector_compare[2];
  uint8_t output_port[2], output_bit[2];
  const uint8_t *prescalers;
  uint32_t maximum;
  /* how it is set */
  count_mode mode;
  top_source top_from;
  uint32_t fixed_top;
  uint8_t prescaler;           /* a count takes 1 << this CPU cycles; NO_CLOCK: stopped, or clocked from outside */
  uint8_t action[2];           /* COMnx: 0 none, 1 toggle, 2 clear, 3 set */
  uint32_t compare[2];         /* in force */
  uint32_t compare_written[2]; /* comes into force at once, or in PWM modes at the end of a lap */
  uint32_t capture;            /* ICR1 */
  uint8_t high_byte;           /* TEMP */
  uint16_t open_half; /* address of the byte that was written last, if its other half was not written before it */
  /* where it is at cycle `known` */
  uint64_t known;
  uint64_t next;      /* counts from there until something happens; 0: to be found anew */
  uint32_t count;     /* TCNTn */
  bool falling;       /* in phase-correct modes: on its way down */
  bool match_blocked; /* the count was written: no compare match at the next count (17.10.4) */
  uint8_t output_level[2];
} timer_state;

/* ---- USART ---- */

typedef struct {
  uint64_t start;    /* of the start bit, in cycles << 16 */
  uint64_t bit_time; /* in cycles << 16 */
  uint8_t bits;      /* with start and stop bits */
  uint8_t byte;
  bool logged; /* in the outside log */
} line_frame;

/* What stands on one direction of the line, in the order of time. */
typedef struct {
  line_frame *frames;
  size_t first, end, capacity;
} line_queue;

typedef struct {
  uint64_t arrived; /* cycle */
  uint8_t byte;
  bool framing_error;
  bool overrun; /* a byte was lost before this one */
} received_byte;

typedef struct {
  uint64_t end; /* of the stop bit, in cycles */
  uint8_t byte;
} sent_byte;

typedef struct {
  /* set by the program */
  uint32_t bit_time; /* in cycles */
  uint8_t data_bits;
  bool has_parity;
  uint8_t frame_bits; /* with start, parity and stop bits */
  /* transmitter */
  bool sending;
  bool holding; /* a byte waits in UDR0 */
  uint8_t holding_byte;
  /* receiver */
  enum { RECEIVER_OFF, RECEIVER_SEARCHING, RECEIVER_SAMPLING } receiver;
  uint64_t from;         /* searching: since when; sampling: start of the frame; cycles << 16 */
  received_byte waiting; /* in the shift register, the buffer being full */
  bool has_waiting;
  bool lost; /* since the last byte that went into the buffer */
  received_byte buffer[2];
  uint8_t buffered;
  /* the outside */
  uint32_t line_bit_time; /* in cycles << 16 */
  bool line_follows;      /* it is the board's own, but for line_off */
  double line_off;
  uint64_t line_free; /* when the line's last byte ends, cycles << 16 */
  line_queue to_board;
  line_queue from_board;
  uint64_t outside_from;  /* since when the outside looks for a start bit, cycles << 16 */
  uint64_t outside_start; /* of the byte that it reads, or NEVER */
  sent_byte *out;         /* bytes that the outside has read */
  size_t out_first, out_end, out_capacity;
} usart_state;

/* ---- two-wire interface ---- */

typedef enum {
  TWI_IDLE,      /* also: something is complete, and the program's turn */
  TWI_WAIT_FREE, /* for a free bus, to send START */
  TWI_WAIT_HIGH, /* for SCL, which was let go, to be high */
  TWI_BIT_SET,
  TWI_BIT_RISE,
  TWI_BIT_FALL,
  TWI_RESTART_RISE,
  TWI_START_FALL,
  TWI_START_HOLD,
  TWI_STOP_RISE,
  TWI_STOP_END
} twi_phase;

typedef struct {
  uint8_t control;   /* TWCR without TWINT */
  uint8_t rate;      /* TWBR */
  uint8_t prescaler; /* TWPS */
  uint8_t data;      /* TWDR */
  uint8_t status;    /* of what was completed last */
  bool owner;        /* the bus is ours: from START to STOP */
  bool sda_low;      /* held low by us */
  twi_phase phase;
  twi_phase after_rise; /* of WAIT_HIGH */
  bool is_address;      /* the byte under way is an address */
  bool receiving;
  uint8_t shift;
  uint8_t bit;     /* 0..7 data, 8 acknowledgement */
  uint64_t fallen; /* when SCL fell before this bit */
} twi_state;

/* ---- SPI ---- */

typedef struct {
  uint8_t control; /* SPCR */
  bool doubled;    /* SPI2X */
  bool collided;   /* WCOL */
  uint8_t seen;    /* flags that were 1 when SPSR was read, until SPDR is */
  uint8_t half;    /* half periods of the transfer that are over; 16: none is under way */
  uint8_t out, in; /* bits still to be sent, and those that came */
  bool bit;        /* at MOSI */
  uint8_t data;    /* received */
} spi_state;

/* ---- ADC, watchdog ---- */

typedef struct {
  board_analog_source *source;
  void *context;
  uint64_t enabled_at;
  uint64_t done;          /* when the conversion ends */
  uint64_t band_gap_from; /* since when the band gap is switched to the converter */
  bool first;             /* the next conversion is the first since the converter was enabled */
  bool begun;             /* its first clock edge is past: the channel is fixed */
  bool sampled;
  uint64_t hold;     /* when the input is held */
  uint8_t selection; /* ADMUX of the conversion under way */
  uint16_t result;   /* in the register, as ADLAR has it */
  uint16_t sample;
  bool locked; /* ADCL was read, ADCH not yet */
} converter_state;

typedef struct {
  uint64_t since;        /* when its counter was last reset */
  uint64_t change_until; /* WDCE is set before this cycle */
  uint32_t warned_at;    /* where its interrupt found the program, or NO_ADDRESS */
  uint64_t warned_cycle; /* when that was */
} watchdog_state;

/* ---- EEPROM ---- */

typedef struct {
  board_eeprom face;
  uint8_t cells[BOARD_EEPROM_SIZE];
  uint64_t armed_until; /* EEMPE is set before this cycle */
  uint16_t selected;    /* EEAR */
  uint8_t data;         /* EEDR */
  bool writing;         /* EEPE */
  uint8_t mode;         /* EEPM of the write under way */
  uint16_t address;     /* of the write under way */
  uint8_t value;        /* that it ends with */
} eeprom_state;

/* ---- self-programming ---- */

typedef struct {
  uint8_t control; /* SPMCSR without RWWSB */
  bool busy;       /* a page is erased or written */
  bool blocked;    /* RWWSB */
  uint16_t page;   /* its address */
  uint8_t buffer[AVR_PAGE_SIZE];
} flash_state;

/* ---- the board ---- */

struct avr_board {
  board base;
  avr_core core;
  uint64_t due[DUE_COUNT];
  bool held;            /* in brown-out reset */
  uint8_t reset_wanted; /* bits 1 << board_reset_cause */
  bool crashed;
  char fault[160];
  uint32_t fault_address; /* of the instruction that crashed the board, or NO_ADDRESS */
  uint16_t variables_end; /* in data memory; the stack's floor is there, or at RAM's begin while it lies among them */
  uint8_t high_fuse;      /* the fuses' byte that says where the boot section is (avr_chip.h) */
  uint32_t reset_address; /* where a reset leads: 0, or into the boot section, as that fuse says */
  bool no_fast_forward;   /* each instruction by itself, sleep cycle by cycle */
  struct avr_recorder *recorder; /* NULL: nothing is recorded */
  struct avr_debugging *debug;   /* NULL: no debugger */
  board_checks checks;
  board_counters counters;
  const struct chip_register *unbuilt[0x100];
  avr_register_write *behind[0x100]; /* of registers that are not whole: what writes the bits that are built */
  board_notes notes;
  uint64_t timer_base[2]; /* when the prescalers were reset: timers 0 and 1, timer 2 */
  port_state port[PORT_COUNT];
  change_queue driven_edges;
  change_queue seen_edges;
  uint8_t clock_pins;    /* T0 and T1 in port D, where their edges are counted */
  uint8_t capture_level; /* of the capture pin, behind the noise filter */
  timer_state timer[3];
  usart_state usart;
  twi_state twi;
  spi_state spi;
  converter_state converter;
  watchdog_state watchdog;
  board_watchdog_log watchdog_log;
  board_outside_log outside_log;
  uint8_t levels[BOARD_PIN_COUNT]; /* see BOARD_PIN_LEVELS */
  eeprom_state eeprom;
  flash_state programming;
};

_Static_assert(AVR_DATA_SIZE == BOARD_DATA_SIZE, "the board offers the data memory of its core");

/* avr_run.c */
board_state run_until(avr_board *b, uint64_t until);
void restart(avr_board *b); /* for the causes in `reset_wanted` */
void set_due(avr_board *b, due_source source, uint64_t cycle);
void raise_flag(avr_board *b, uint8_t vector);
void clear_flag(avr_board *b, uint8_t vector);
void enable_interrupt(avr_board *b, uint8_t vector, bool enabled);
void interrupts_changed(avr_board *b); /* after a change of `raised` or `enabled` */
void want_reset(avr_board *b, board_reset_cause cause);
/* The board stops; `address` is that of the instruction to blame, the rest says what it did, without place and time. */
void crash_at(avr_board *b, uint32_t address, const char *format, ...) __attribute__((format(printf, 3, 4)));
/* The board stops if the instruction at `address` has moved the stack pointer to where it may not be. `set`: the program
 * has set it to where it is, which may be among the variables; else it has grown there. */
void check_stack(avr_board *b, uint32_t address, bool set);
void halt_cpu(avr_board *b, unsigned cycles); /* before the next instruction; to be called by an access */
extern const avr_owner_calls CALLS_OF_CORE;

/* avr_registers.c */
void on_read(avr_board *b, uint16_t address, avr_register_read *read);
void on_write(avr_board *b, uint16_t address, avr_register_write *write);
void on_ones(avr_board *b,
             uint16_t address);        /* SBI writes its bit alone, CBI does nothing: the register acts on ones */
void registers_init(avr_board *b);     /* before all that claim registers */
void registers_complete(avr_board *b); /* behind them */
/* Keeps what the instruction at `address` does, and `why` that is not what it seems; all literals. Once for each. */
void note(avr_board *b, uint32_t address, const char *does, const char *what, const char *why);
void note_place(avr_board *b, uint32_t address, const char *does, const char *what, const char *why); /* at each once */

/* avr_pins.c */
void pins_init(avr_board *b);
void pins_reset(avr_board *b, uint64_t cycle);
void pins_free(avr_board *b);
void pins_due_driven(avr_board *b, uint64_t cycle);
void pins_due_seen(avr_board *b, uint64_t cycle);
void pins_due_noise_filter(avr_board *b, uint64_t cycle);
void pins_update(avr_board *b, uint8_t port, uint64_t cycle); /* after a change of anything but `level` in `port` */
void pins_drive(avr_board *b, uint64_t at, uint8_t pin, uint8_t level);
uint8_t *pins_levels(avr_board *b);
uint8_t pins_output(const avr_board *b, uint8_t pin);
void pins_acknowledged(avr_board *b, uint8_t vector);
uint8_t pin_of(uint8_t port, unsigned bit);       /* Arduino's number; no pin: 255 */
bool pin_floats(const avr_board *b, uint8_t pin); /* an input without pull-up that the outside does not drive */

/* avr_timers.c */
void timers_init(avr_board *b);
void timers_reset(avr_board *b, uint64_t cycle);
void timer_clock_edge(avr_board *b, unsigned number, uint8_t level, uint64_t cycle); /* at T0 or T1 */

/* avr_timer_count.c */
void timer_due(timer_state *t, uint64_t cycle);
void timer_bring_up(timer_state *t, uint64_t cycle);             /* computes flags and count until `cycle` */
void timer_plan(timer_state *t);                                 /* computes when it is due next */
void timer_capture(avr_board *b, uint8_t level, uint64_t cycle); /* an edge at ICP1 */
timer_state *timer_of_vector(avr_board *b, uint8_t vector);      /* NULL: no timer's */

/* avr_usart.c */
void usart_init(avr_board *b);
void usart_reset(avr_board *b);
void usart_free(avr_board *b);
void usart_due_transmitter(avr_board *b, uint64_t cycle);
void usart_due_receiver(avr_board *b, uint64_t cycle);
void usart_due_bit(avr_board *b, uint64_t cycle);
void usart_due_outside(avr_board *b, uint64_t cycle);
void usart_watched(avr_board *b, uint8_t mask, uint64_t cycle);
uint8_t usart_at_pins(const avr_board *b, uint8_t level, uint64_t cycle); /* PIND at an access: level with the line's */
void usart_send(avr_board *b, uint64_t at, const uint8_t *bytes, size_t count);
size_t usart_receive(avr_board *b, uint8_t *bytes, uint64_t *cycles, size_t capacity);
void usart_line_rate(avr_board *b, uint32_t baud);

/* avr_twi.c */
void twi_init(avr_board *b);
void twi_reset(avr_board *b);
void twi_due(avr_board *b, uint64_t cycle);
void twi_line_moved(avr_board *b, uint64_t cycle); /* SDA or SCL */

/* avr_spi.c */
void spi_init(avr_board *b);
void spi_reset(avr_board *b);
void spi_due(avr_board *b, uint64_t cycle);
void spi_pins_moved(avr_board *b, uint64_t cycle); /* after a change at port B */

/* avr_converter.c */
void converter_init(avr_board *b);
void converter_reset(avr_board *b);
void converter_due(avr_board *b, uint64_t cycle);

/* avr_watchdog.c */
void watchdog_init(avr_board *b);
void watchdog_reset(avr_board *b, uint64_t cycle);
void watchdog_due(avr_board *b, uint64_t cycle);
void watchdog_kick(avr_board *b);
void watchdog_acknowledged(avr_board *b);
void watchdog_free(avr_board *b);

/* avr_eeprom.c */
void eeprom_init(avr_board *b);
void eeprom_reset(avr_board *b, bool power_failed);
void eeprom_due(avr_board *b, uint64_t cycle);

/* avr_flash.c */
void flash_init(avr_board *b);
void flash_reset(avr_board *b);
void flash_due(avr_board *b, uint64_t cycle);
void flash_store(avr_board *b);                     /* SPM */
uint8_t flash_load(avr_board *b, uint16_t address); /* LPM while SPMCSR is not 0 */
void flash_code_ends(avr_board *b, uint32_t end);
void flash_is_another(avr_board *b); /* than the image: anything in it may be code, and anything in RAM stack */
void flash_gives_way(avr_board *b);  /* to a write of the EEPROM: what was loaded or asked for is lost (27.8.2) */
void memories_changed(avr_board *b); /* after the begin or end of a write of either */

/* avr_spans.c; all but spans_free only while there is a recorder */
uint32_t run_recorded(avr_board *b, uint64_t until);             /* as avr_run; stops where something is recorded */
void spans_accept(avr_board *b, uint8_t vector, uint64_t begin); /* an interrupt begins, its flag is still raised */
void spans_requested(avr_board *b, uint8_t vector, uint64_t cycle);
void spans_request_gone(avr_board *b, uint8_t vector);
void spans_woke(avr_board *b);
void spans_restart(avr_board *b);
void spans_free(avr_board *b);

/* avr_checks.c; only while the program is checked, but for those of inputs */
void check_driven(avr_board *b, uint8_t pin, bool high);      /* board and outside drive it against each other */
void check_read(avr_board *b, uint8_t port);                  /* by the instruction under way */
void check_watched(avr_board *b, uint8_t port, uint8_t mask); /* by an interrupt */
void check_analog(avr_board *b, uint8_t channel);
void check_never_written(avr_board *b); /* RAM, which the instruction under way reads */

/* avr_debug.c; all but debug_free only while there is a debugger. False: it has ended the run */
bool debug_looks(avr_board *b);
bool debug_before(avr_board *b); /* an instruction */
bool debug_crashed(avr_board *b);
uint32_t run_debugged(avr_board *b, uint64_t until); /* as avr_run */
void debug_free(avr_board *b);

#endif
