/* avr_converter.c: the analog-to-digital converter (24): 13 clocks of the converter for a conversion, 25 for the first
 * one after it was enabled; the input is held 1.5 (13.5) clocks after the start. Channel and reference are those at the
 * first of these clocks. Single conversions and free running; no other trigger comes.
 *
 * The reference is AVCC, at the supply, or the band gap; nothing is joined to AREF, which reads as AVCC. The band gap as
 * input (channel 14) is good 70 us after it was selected (29.5, the longest start-up time), until then too low.
 */
#include "avr_parts.h"

#define BAND_GAP_CYCLES (70u * (BOARD_CLOCK_HZ / 1000000u))
#define STEPS 1024.0

enum { ADEN = 0x80, ADSC = 0x40, ADATE = 0x20, ADIF = 0x10, ADIE = 0x08, ADPS = 0x07 }; /* ADCSRA */
enum { REFS = 0xC0, ADLAR = 0x20, MUX = 0x0F, MUX_BAND_GAP = 14 };                      /* ADMUX */
enum { ADTS = 0x07 };                                                                   /* ADCSRB */

static uint64_t clock_cycles(const avr_board *b) {
  unsigned setting = b->core.data[REG_ADCSRA] & ADPS;
  return UINT64_C(1) << (setting ? setting : 1);
}

static void note_missing(avr_board *b) {
  const uint8_t selection = b->core.data[REG_ADMUX], channel = selection & MUX;
  if (channel >= BOARD_ANALOG_COUNT && channel < MUX_BAND_GAP) {
    note(b, b->core.pc, "converts", "a channel without pin",
         "it has none (6, 7), is reserved, or is the temperature, which is not built: it reads 0 V");
  }
  if (!(selection & REFS)) {
    note(b, b->core.pc, "converts with", "the reference AREF", "nothing is joined to it: it is at the supply");
  }
}

/* A conversion that was asked for at `cycle`. */
static void start(avr_board *b, uint64_t cycle) {
  converter_state *c = &b->converter;
  uint64_t clock = clock_cycles(b);
  uint64_t first_edge = c->enabled_at + ((cycle - c->enabled_at) / clock + 1) * clock;
  c->hold = first_edge + (c->first ? clock * 27 / 2 : clock * 3 / 2);
  c->done = first_edge + clock * (c->first ? 25 : 13);
  c->first = false;
  c->begun = c->sampled = false;
  set_due(b, DUE_CONVERTER, first_edge);
}

static double band_gap_at(const converter_state *c, uint64_t cycle) {
  uint64_t since = c->band_gap_from > c->enabled_at ? c->band_gap_from : c->enabled_at;
  uint64_t settled = cycle - since;
  return settled >= BAND_GAP_CYCLES ? BOARD_BAND_GAP_VOLTS : BOARD_BAND_GAP_VOLTS * (double)settled / BAND_GAP_CYCLES;
}

static double volts_at(const avr_board *b, uint64_t cycle) {
  const converter_state *c = &b->converter;
  unsigned channel = c->selection & MUX;
  if (channel == MUX_BAND_GAP) return band_gap_at(c, cycle);
  return channel > 5 || !c->source ? 0.0 : c->source(c->context, cycle, (uint8_t)channel);
}

static double reference_at(const avr_board *b, uint64_t cycle) {
  if ((b->converter.selection & REFS) == REFS) return BOARD_BAND_GAP_VOLTS;
  return board_supply_volts(b->converter.source, b->converter.context, cycle);
}

static uint16_t convert(const avr_board *b, uint64_t cycle) {
  double steps = volts_at(b, cycle) / reference_at(b, cycle) * STEPS;
  if (!(steps > 0.0)) return 0;
  return steps >= STEPS - 1.0 ? 1023 : (uint16_t)steps;
}

void converter_due(avr_board *b, uint64_t cycle) {
  converter_state *c = &b->converter;
  uint8_t *control = &b->core.data[REG_ADCSRA];
  if (!c->begun) {
    c->begun = true;
    c->selection = b->core.data[REG_ADMUX];
    set_due(b, DUE_CONVERTER, c->hold);
    return;
  }
  if (!c->sampled) {
    c->sample = convert(b, cycle);
    c->sampled = true;
    set_due(b, DUE_CONVERTER, c->done);
    return;
  }
  set_due(b, DUE_CONVERTER, NEVER);
  if (!c->locked) c->result = (uint16_t)(b->core.data[REG_ADMUX] & ADLAR ? c->sample << 6 : c->sample);
  raise_flag(b, VECTOR_ADC);
  if ((*control & ADATE) && !(b->core.data[REG_ADCSRB] & ADTS)) {
    start(b, cycle - 1); /* at this very edge */
  } else {
    *control &= (uint8_t)~ADSC;
  }
}

static uint8_t read_control(avr_board *b, uint16_t address, uint64_t cycle) {
  return (uint8_t)((b->core.data[address] & ~ADIF) | (b->core.raised & FLAG(VECTOR_ADC) ? ADIF : 0));
}

static void write_control(avr_board *b, uint16_t address, uint8_t value, uint64_t end) {
  converter_state *c = &b->converter;
  bool converting = b->due[DUE_CONVERTER] != NEVER;
  bool was_enabled = b->core.data[address] & ADEN;
  if (value & ADIF) clear_flag(b, VECTOR_ADC);
  b->core.data[address] = (uint8_t)(value & ~ADIF);
  enable_interrupt(b, VECTOR_ADC, value & ADIE);
  if (!(value & ADEN)) {
    b->core.data[address] &= (uint8_t)~ADSC;
    set_due(b, DUE_CONVERTER, NEVER);
    return;
  }
  if (!was_enabled) {
    c->enabled_at = end;
    c->first = true;
  }
  if (converting) {
    b->core.data[address] |= ADSC; /* writing 0 does not stop it */
  } else if (value & ADSC) {
    note_missing(b);
    check_analog(b, b->core.data[REG_ADMUX] & MUX);
    start(b, end);
  }
}

static void write_selection(avr_board *b, uint16_t address, uint8_t value, uint64_t end) {
  if ((b->core.data[address] & MUX) != MUX_BAND_GAP) b->converter.band_gap_from = end;
  b->core.data[address] = value;
}

static uint8_t read_low(avr_board *b, uint16_t address, uint64_t cycle) {
  b->converter.locked = true; /* until the high byte is read */
  return (uint8_t)b->converter.result;
}

static uint8_t read_high(avr_board *b, uint16_t address, uint64_t cycle) {
  b->converter.locked = false;
  return (uint8_t)(b->converter.result >> 8);
}

void converter_reset(avr_board *b) {
  board_analog_source *source = b->converter.source;
  void *context = b->converter.context;
  b->converter = (converter_state){.source = source, .context = context};
  set_due(b, DUE_CONVERTER, NEVER);
}

void converter_init(avr_board *b) {
  on_read(b, REG_ADCSRA, read_control);
  on_write(b, REG_ADCSRA, write_control);
  on_write(b, REG_ADMUX, write_selection);
  on_read(b, REG_ADCL, read_low);
  on_read(b, REG_ADCH, read_high);
}
