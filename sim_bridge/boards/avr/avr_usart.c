/* avr_usart.c: USART0 in asynchronous mode (20), and the line between it and the outside.
 *
 * The line is a waveform in each direction: the outside's bytes back to back, 8N1, at the outside's bit rate, and the
 * board's frames at its own. An outside that follows the board reads each frame at that frame's bit rate, and sends at the
 * one that the board has when the byte's turn comes; bytes wait while the board's receiver is off. A receiver looks for a falling edge and samples the middle of each bit by its own clock, so
 * that a wrong bit rate gives what it gives on the bench: garbage and framing errors. The board's receiver holds two bytes in its buffer and one in the shift register; when a start
 * bit comes while all three are full, the third is lost and the next byte read bears DOR0 (20.8.1). RXC is set when the
 * stop bit has been sampled, a little before its end.
 *
 * A byte is complete for the outside at the end of its stop bit, whatever level that has. The board's bits show at pin 1
 * to whom the program lets look there: its reads of PIND, and while PCINT17 is unmasked every edge. Else the pin rests high,
 * as pin 0 does, and bits cost nothing. Synchronous and SPI modes, the ninth bit's value and parity checks are not built.
 */
#include <stdlib.h>

#include "avr_parts.h"

enum { RXC = 0x80, TXC = 0x40, UDRE = 0x20, FE = 0x10, DOR = 0x08, U2X = 0x02, MPCM = 0x01 }; /* UCSR0A */
enum { RXCIE = 0x80, TXCIE = 0x40, UDRIE = 0x20, RXEN = 0x10, TXEN = 0x08, UCSZ2 = 0x04 };    /* UCSR0B */
enum { UPM1 = 0x20, USBS = 0x08 };                                                            /* UCSR0C */
enum { RX_MASK = 1, TX_MASK = 2 };                                                            /* of port D */

#define LINE_BITS 10u /* of the outside's frames */
#define FRACTION 16   /* binary places of the times on the line */
#define SLOWEST_BAUD 300u
#define FOLLOWS 0u               /* a rate: the board's own */
#define HELD (UINT64_C(1) << 62) /* a time that does not come: of frames that wait */

/* ---- the line ---- */

static uint64_t end_of(const line_frame *f) { return f->start + (uint64_t)f->bits * f->bit_time; }

/* The level of a frame's bit: start, eight data bits, stop. */
static bool bit_of(uint8_t byte, uint64_t index) {
  if (index == 0) return false;
  return index > 8 || (byte >> (index - 1) & 1);
}

static bool line_level(const line_queue *q, uint64_t time) {
  for (size_t i = q->first; i < q->end; i++) {
    const line_frame *f = &q->frames[i];
    if (time < f->start) break;
    if (time < end_of(f)) return bit_of(f->byte, (time - f->start) / f->bit_time);
  }
  return true;
}

/* The first falling edge at or after `time`. */
static uint64_t falling_edge(const line_queue *q, uint64_t time) {
  for (size_t i = q->first; i < q->end; i++) {
    const line_frame *f = &q->frames[i];
    if (end_of(f) <= time) continue;
    uint64_t bit = time > f->start ? (time - f->start) / f->bit_time : 0;
    bool before = bit == 0 || bit_of(f->byte, bit - 1);
    for (; bit < f->bits; bit++) {
      uint64_t edge = f->start + bit * f->bit_time;
      bool level = bit_of(f->byte, bit);
      if (before && !level && edge >= time) return edge;
      before = level;
    }
  }
  return NEVER;
}

/* As a receiver by its own bit time sees the byte whose start bit begins at `start`. */
static uint8_t byte_on_line(const line_queue *q, uint64_t start, uint64_t bit_time, unsigned bits) {
  for (size_t i = q->first; i < q->end && q->frames[i].start <= start; i++) { /* mostly it is that of the frame */
    const line_frame *f = &q->frames[i];
    if (f->start == start && f->bit_time == bit_time && f->bits > 9 && bits == 8) return f->byte;
  }
  uint8_t byte = 0;
  for (unsigned bit = 0; bit < bits && bit < 8; bit++) {
    if (line_level(q, start + bit_time * (2 * bit + 3) / 2)) byte |= (uint8_t)(1u << bit);
  }
  return byte;
}

static void log_frame(struct board_frames *log, const line_frame *f) {
  log->items = board_room_for(log->items, sizeof *log->items, &log->first, &log->end, &log->capacity, 1);
  log->items[log->end++] =
      (board_frame){.start = f->start, .bit_time = f->bit_time, .bits = (uint8_t)f->bits, .byte = f->byte};
}

/* Frames to the board that have begun by then. */
static void log_begun(avr_board *b, uint64_t time) {
  line_queue *q = &b->usart.to_board;
  for (size_t i = q->first; b->outside_log.on && i < q->end && q->frames[i].start <= time; i++) {
    if (!q->frames[i].logged) log_frame(&b->outside_log.to_board, &q->frames[i]);
    q->frames[i].logged = true;
  }
}

static void forget_line(line_queue *q, uint64_t until) {
  while (q->first < q->end && end_of(&q->frames[q->first]) <= until) q->first++;
  if (q->first == q->end) q->first = q->end = 0;
}

static void put_on_line(line_queue *q, line_frame frame) {
  q->frames = board_room_for(q->frames, sizeof *q->frames, &q->first, &q->end, &q->capacity, 1);
  q->frames[q->end++] = frame;
}

/* ---- receiver ---- */

static void update_receive_flag(avr_board *b) {
  if (b->usart.buffered) {
    raise_flag(b, VECTOR_USART_RX);
  } else {
    clear_flag(b, VECTOR_USART_RX);
  }
}

/* Start, data and parity bits: what comes before the stop bit that the receiver checks. */
static unsigned bits_before_stop(const usart_state *u) { return 1u + u->data_bits + (u->has_parity ? 1u : 0u); }

/* From the start of a frame to the stop bit's last sample, after which the next start bit may come: 5/8 or 9/16 into
 * the bit (20.8.3). */
static uint64_t sampled_after(const avr_board *b) {
  const usart_state *u = &b->usart;
  bool double_speed = b->core.data[REG_UCSR0A] & U2X;
  uint64_t bit_time = (uint64_t)u->bit_time << FRACTION;
  return bits_before_stop(u) * bit_time + bit_time * (double_speed ? 10 : 9) / 16;
}

static void plan_receiver(avr_board *b) {
  usart_state *u = &b->usart;
  uint64_t time = NEVER;
  if (u->receiver == RECEIVER_SEARCHING) time = falling_edge(&u->to_board, u->from);
  if (u->receiver == RECEIVER_SAMPLING) time = u->from + sampled_after(b);
  uint64_t round_up = (UINT64_C(1) << FRACTION) - 1;
  set_due(b, DUE_RECEIVER, time == NEVER ? NEVER : (time + round_up) >> FRACTION);
}

static void start_bit(avr_board *b) {
  usart_state *u = &b->usart;
  u->from = falling_edge(&u->to_board, u->from);
  u->receiver = RECEIVER_SAMPLING;
  log_begun(b, u->from);
  if (u->has_waiting) { /* the shift register is overwritten */
    u->has_waiting = false;
    u->lost = true;
    b->counters.overruns++;
  }
}

static void stop_bit(avr_board *b) {
  usart_state *u = &b->usart;
  uint64_t bit_time = (uint64_t)u->bit_time << FRACTION;
  received_byte r = {.arrived = b->core.clock, .byte = byte_on_line(&u->to_board, u->from, bit_time, u->data_bits)};
  r.framing_error = !line_level(&u->to_board, u->from + bit_time * (2 * bits_before_stop(u) + 1) / 2);
  bool noise = line_level(&u->to_board, u->from + bit_time / 2); /* no start bit after all */
  u->receiver = RECEIVER_SEARCHING;
  u->from += noise ? bit_time / 2 : sampled_after(b);
  forget_line(&u->to_board, u->from);
  if (noise) return;
  b->counters.bytes_in++;
  if (r.framing_error) b->counters.framing_errors++;
  r.overrun = u->lost;
  u->lost = false;
  if (u->buffered < 2) {
    u->buffer[u->buffered++] = r;
    update_receive_flag(b);
  } else {
    u->waiting = r;
    u->has_waiting = true;
  }
}

void usart_due_receiver(avr_board *b, uint64_t cycle) {
  if (b->usart.receiver == RECEIVER_SEARCHING) {
    start_bit(b);
  } else {
    stop_bit(b);
  }
  plan_receiver(b);
}

static void empty_receiver(usart_state *u) {
  u->buffered = 0;
  u->has_waiting = false;
  u->lost = false;
}

static uint8_t read_data(avr_board *b, uint16_t address, uint64_t cycle) {
  usart_state *u = &b->usart;
  uint8_t byte = u->buffer[0].byte;
  if (u->buffered) {
    u->buffer[0] = u->buffer[1];
    u->buffered--;
    if (u->has_waiting) {
      u->buffer[u->buffered++] = u->waiting;
      u->has_waiting = false;
    }
    update_receive_flag(b);
  }
  return byte;
}

/* ---- transmitter ---- */

/* Of an outside that follows the board, where a bit takes the board that long. */
static uint64_t followed(const usart_state *u, uint64_t bit_time) {
  return (uint64_t)((double)bit_time / (1.0 + u->line_off));
}

/* By which the outside reads the byte at `outside_start`. */
static uint64_t outside_bit_time(const usart_state *u) {
  const line_queue *q = &u->from_board;
  for (size_t i = q->first; u->line_follows && i < q->end; i++) {
    if (u->outside_start < end_of(&q->frames[i])) return followed(u, q->frames[i].bit_time);
  }
  return u->line_bit_time;
}

/* The outside's receiver: when it will have read the next byte. */
static void plan_outside(avr_board *b) {
  usart_state *u = &b->usart;
  u->outside_start = falling_edge(&u->from_board, u->outside_from);
  bool idle = u->outside_start == NEVER;
  set_due(b, DUE_OUTSIDE, idle ? NEVER : (u->outside_start + LINE_BITS * outside_bit_time(u)) >> FRACTION);
}

void usart_due_outside(avr_board *b, uint64_t cycle) {
  usart_state *u = &b->usart;
  uint64_t bit_time = outside_bit_time(u);
  uint8_t byte = byte_on_line(&u->from_board, u->outside_start, bit_time, 8);
  u->out = board_room_for(u->out, sizeof *u->out, &u->out_first, &u->out_end, &u->out_capacity, 1);
  u->out[u->out_end++] = (sent_byte){cycle, byte};
  u->outside_from = u->outside_start + bit_time * (2 * LINE_BITS - 1) / 2;
  forget_line(&u->from_board, u->outside_from);
  plan_outside(b);
}

/* Each bit of the frame under way moves the pin; behind the last one the line rests. */
void usart_due_bit(avr_board *b, uint64_t cycle) {
  const usart_state *u = &b->usart;
  port_state *p = &b->port[PORT_D];
  bool high = line_level(&u->from_board, cycle << FRACTION);
  p->forced_level = (uint8_t)(high ? p->forced_level | TX_MASK : p->forced_level & ~TX_MASK);
  pins_update(b, PORT_D, cycle);
  uint64_t next = NEVER;
  if (u->sending) {
    const line_frame *f = &u->from_board.frames[u->from_board.end - 1];
    uint64_t bit_time = f->bit_time >> FRACTION;
    next = cycle + bit_time - (cycle - (f->start >> FRACTION)) % bit_time;
  }
  set_due(b, DUE_BIT, next);
}

/* Before the mask of port D's pin changes becomes this. What the pin does already is no edge. */
void usart_watched(avr_board *b, uint8_t mask, uint64_t cycle) {
  if ((mask & TX_MASK) && b->usart.sending && b->due[DUE_BIT] == NEVER) usart_due_bit(b, cycle);
}

uint8_t usart_at_pins(const avr_board *b, uint8_t level, uint64_t cycle) {
  if (!b->usart.sending || !(b->port[PORT_D].forced & TX_MASK)) return level;
  bool high = line_level(&b->usart.from_board, (cycle << FRACTION) - 1);
  return (uint8_t)(high ? level | TX_MASK : level & ~TX_MASK);
}

static void begin_frame(avr_board *b, uint8_t byte, uint64_t cycle) {
  usart_state *u = &b->usart;
  u->sending = true;
  put_on_line(&u->from_board,
              (line_frame){cycle << FRACTION, (uint64_t)u->bit_time << FRACTION, u->frame_bits, byte, false});
  if (b->outside_log.on) log_frame(&b->outside_log.from_board, &u->from_board.frames[u->from_board.end - 1]);
  if (u->outside_start == NEVER) plan_outside(b);
  set_due(b, DUE_TRANSMITTER, cycle + (uint64_t)u->frame_bits * u->bit_time);
  if (b->core.data[REG_PCMSK0 + PORT_D] & TX_MASK) set_due(b, DUE_BIT, cycle);
}

static void drive_transmit_pin(avr_board *b, uint64_t cycle) {
  port_state *p = &b->port[PORT_D];
  bool on = (b->core.data[REG_UCSR0B] & TXEN) || b->usart.sending;
  bool was_on = p->forced_out & TX_MASK;
  if (on == was_on) return;
  p->forced_out ^= TX_MASK;
  p->forced ^= TX_MASK;
  p->forced_level |= TX_MASK;
  pins_update(b, PORT_D, cycle);
}

void usart_due_transmitter(avr_board *b, uint64_t cycle) {
  usart_state *u = &b->usart;
  b->counters.bytes_out++;
  if (u->holding) {
    u->holding = false;
    begin_frame(b, u->holding_byte, cycle);
    raise_flag(b, VECTOR_USART_UDRE);
  } else {
    u->sending = false;
    set_due(b, DUE_TRANSMITTER, NEVER);
    raise_flag(b, VECTOR_USART_TX);
    drive_transmit_pin(b, cycle);
  }
}

static void write_data(avr_board *b, uint16_t address, uint8_t value, uint64_t end) {
  usart_state *u = &b->usart;
  if (!(b->core.data[REG_UCSR0B] & TXEN) || u->holding) {
    note(b, b->core.pc, "writes to", "UDR0", "it is dropped: TXEN0 or UDRE0 is not set (20.11.1)");
    return;
  }
  if (u->sending) {
    u->holding = true;
    u->holding_byte = value;
    clear_flag(b, VECTOR_USART_UDRE);
  } else {
    begin_frame(b, value, end);
  }
}

/* ---- control registers ---- */

static void update_settings(avr_board *b) {
  static const uint8_t sizes[8] = {5, 6, 7, 8, 8, 8, 8, 9};
  const uint8_t *data = b->core.data;
  usart_state *u = &b->usart;
  uint32_t divisor = (data[REG_UBRR0L] | (uint32_t)(data[REG_UBRR0H] & 0x0F) << 8) + 1;
  u->bit_time = divisor * (data[REG_UCSR0A] & U2X ? 8 : 16);
  u->data_bits = sizes[(data[REG_UCSR0C] >> 1 & 3) | (data[REG_UCSR0B] & UCSZ2)];
  u->has_parity = data[REG_UCSR0C] & UPM1;
  u->frame_bits = (uint8_t)(2 + u->data_bits + (u->has_parity ? 1 : 0) + (data[REG_UCSR0C] & USBS ? 1 : 0));
  if (u->line_follows) usart_line_rate(b, FOLLOWS);
  plan_receiver(b);
}

static uint8_t read_status(avr_board *b, uint16_t address, uint64_t cycle) {
  const usart_state *u = &b->usart;
  uint8_t value = b->core.data[address] & (U2X | MPCM);
  if (b->core.raised & FLAG(VECTOR_USART_RX)) value |= RXC;
  if (b->core.raised & FLAG(VECTOR_USART_TX)) value |= TXC;
  if (b->core.raised & FLAG(VECTOR_USART_UDRE)) value |= UDRE;
  if (u->buffered && u->buffer[0].framing_error) value |= FE;
  if (u->buffered && u->buffer[0].overrun) value |= DOR;
  return value;
}

static void write_status(avr_board *b, uint16_t address, uint8_t value, uint64_t end) {
  if (value & TXC) clear_flag(b, VECTOR_USART_TX);
  b->core.data[address] = value & (U2X | MPCM);
  update_settings(b);
}

static void write_control(avr_board *b, uint16_t address, uint8_t value, uint64_t end) {
  usart_state *u = &b->usart;
  b->core.data[address] = value;
  enable_interrupt(b, VECTOR_USART_RX, value & RXCIE);
  enable_interrupt(b, VECTOR_USART_TX, value & TXCIE);
  enable_interrupt(b, VECTOR_USART_UDRE, value & UDRIE);
  port_state *p = &b->port[PORT_D];
  p->forced_in = (uint8_t)(value & RXEN ? p->forced_in | RX_MASK : p->forced_in & ~RX_MASK);
  pins_update(b, PORT_D, end);
  drive_transmit_pin(b, end);
  if ((value & RXEN) && u->receiver == RECEIVER_OFF) {
    u->receiver = RECEIVER_SEARCHING;
    u->from = end << FRACTION;
    log_begun(b, u->from);
    forget_line(&u->to_board, u->from);
  } else if (!(value & RXEN)) {
    u->receiver = RECEIVER_OFF;
    empty_receiver(u);
    update_receive_flag(b);
  }
  update_settings(b);
}

static void write_setting(avr_board *b, uint16_t address, uint8_t value, uint64_t end) {
  b->core.data[address] = value;
  update_settings(b);
}

/* ---- the outside ---- */

/* Of an outside that follows the board: frames to it that have not begun wait while it does not listen, and go at its
 * present rate. */
static void time_frames(avr_board *b) {
  usart_state *u = &b->usart;
  bool waits = u->receiver == RECEIVER_OFF;
  uint64_t now = b->core.clock << FRACTION, start = waits ? HELD : now + u->line_bit_time;
  u->line_free = waits ? HELD : now;
  for (size_t i = u->to_board.first; i < u->to_board.end; i++) {
    line_frame *f = &u->to_board.frames[i];
    bool has_changed = f->bit_time != u->line_bit_time || (f->start >= HELD) != waits;
    if (f->start > now && has_changed) *f = (line_frame){start, u->line_bit_time, LINE_BITS, f->byte, false};
    u->line_free = start = end_of(f);
  }
}

void usart_send(avr_board *b, uint64_t at, const uint8_t *bytes, size_t count) {
  usart_state *u = &b->usart;
  if (at < b->core.clock) at = b->core.clock;
  uint64_t start = at << FRACTION;
  if (start < u->line_free) start = u->line_free;
  if (u->receiver == RECEIVER_OFF) forget_line(&u->to_board, b->core.clock << FRACTION);
  for (size_t i = 0; i < count; i++) {
    put_on_line(&u->to_board, (line_frame){start, u->line_bit_time, LINE_BITS, bytes[i], false});
    start += (uint64_t)LINE_BITS * u->line_bit_time;
  }
  u->line_free = start;
  plan_receiver(b);
}

size_t usart_receive(avr_board *b, uint8_t *bytes, uint64_t *cycles, size_t capacity) {
  usart_state *u = &b->usart;
  size_t count = 0;
  for (; count < capacity && u->out_first < u->out_end; count++) {
    const sent_byte *sent = &u->out[u->out_first++];
    bytes[count] = sent->byte;
    if (cycles) cycles[count] = sent->end;
  }
  return count;
}

void usart_line_rate(avr_board *b, uint32_t baud) {
  b->usart.line_follows = baud == FOLLOWS;
  if (baud != FOLLOWS && baud < SLOWEST_BAUD) baud = SLOWEST_BAUD;
  uint64_t own = (uint64_t)b->usart.bit_time << FRACTION;
  uint64_t bit = baud == FOLLOWS ? followed(&b->usart, own) : ((uint64_t)BOARD_CLOCK_HZ << FRACTION) / baud;
  b->usart.line_bit_time = bit < UINT32_MAX ? (uint32_t)bit : UINT32_MAX;
  if (baud == FOLLOWS) time_frames(b);
  if (b->usart.outside_start != NEVER) plan_outside(b);
}

/* ---- construction ---- */

void usart_reset(avr_board *b) {
  usart_state *u = &b->usart;
  b->core.data[REG_UCSR0C] = 0x06;
  u->sending = u->holding = false;
  u->receiver = RECEIVER_OFF;
  empty_receiver(u);
  u->from_board.first = u->from_board.end = 0;
  u->outside_start = NEVER;
  set_due(b, DUE_TRANSMITTER, NEVER);
  set_due(b, DUE_BIT, NEVER);
  set_due(b, DUE_OUTSIDE, NEVER);
  raise_flag(b, VECTOR_USART_UDRE);
  update_settings(b);
}

void usart_init(avr_board *b) {
  on_read(b, REG_UDR0, read_data);
  on_write(b, REG_UDR0, write_data);
  on_read(b, REG_UCSR0A, read_status);
  on_write(b, REG_UCSR0A, write_status);
  on_write(b, REG_UCSR0B, write_control);
  on_write(b, REG_UCSR0C, write_setting);
  on_write(b, REG_UBRR0L, write_setting);
  on_write(b, REG_UBRR0H, write_setting);
}

void usart_free(avr_board *b) {
  free(b->usart.to_board.frames);
  free(b->usart.from_board.frames);
  free(b->usart.out);
  free(b->outside_log.to_board.items);
  free(b->outside_log.from_board.items);
}
