/* Storage: saved parameters and boot counter, with the power cut at every cell of every write. */
#include <doctest.h>

#include <map>

#include "memory_bench.h"
extern "C" {
#include "parameters.h"
#include "storage.h"
#include "supply.h"
}

namespace {

constexpr uint64_t MILLISECOND = memory_bench::MILLISECOND;
constexpr uint64_t SECOND = 1000 * MILLISECOND;
constexpr uint64_t TICK = memory_bench::TICK;

/* storage.h: where the records lie. */
constexpr size_t COPIES[] = {0x080, 0x180}, COPY_SIZE = 4 + 2 * PARAMETER_COUNT + 2;
constexpr size_t RING = 256, ENTRIES = 16, ENTRY_SIZE = 8;
constexpr uint8_t VALID = 0xA5;

using values = std::vector<int32_t>;

values in_force() {
  values now;
  for (uint8_t parameter = 0; parameter < PARAMETER_COUNT; parameter++) {
    now.push_back(parameters_get(parameter));
  }
  return now;
}

/* Sets some parameters; different numbers differ in all of them, in several bytes each. */
values choose(int number) {
  REQUIRE(parameters_set(PARAMETER_SERVO_LEFT_CENTRE, 22500 + 1111 * number) == ANSWER_STATUS_OK);
  REQUIRE(parameters_set(PARAMETER_SERVO_RIGHT_GAIN, -3100 + 1234 * number) == ANSWER_STATUS_OK);
  REQUIRE(parameters_set(PARAMETER_TRACK_WIDTH, 10000 + 9999 * number) == ANSWER_STATUS_OK);
  REQUIRE(parameters_set(PARAMETER_BANDGAP, 1050 + 7 * number) == ANSWER_STATUS_OK);
  return in_force();
}

uint8_t save(memory_bench &bench) {
  REQUIRE(storage_save() == ANSWER_STATUS_OK);
  for (int tick = 0; tick < 100 && storage_busy(); tick++) {
    bench.run(TICK);
  }
  REQUIRE_FALSE(storage_busy());
  return storage_result();
}

/* An EEPROM with `first` saved, then `second`, over values from before `first`. */
struct saved {
  values first, second, defaults;
  eeprom_image once, twice;
  std::vector<eeprom_write> writes; /* of the save of `second` */
};

saved save_twice() {
  memory_bench bench;
  saved result;
  bench.power_on();
  result.defaults = in_force();
  choose(0);
  REQUIRE(save(bench) == ANSWER_STATUS_OK);
  result.first = choose(1);
  REQUIRE(save(bench) == ANSWER_STATUS_OK);
  result.once = bench.eeprom();
  result.second = choose(2);
  bench.writes.clear();
  REQUIRE(save(bench) == ANSWER_STATUS_OK);
  result.twice = bench.eeprom();
  result.writes = bench.writes;
  return result;
}

/* What a board has in force that starts with this EEPROM. */
values after_start(const eeprom_image &eeprom) {
  memory_bench bench(eeprom);
  return in_force();
}

void put_crc(eeprom_image &eeprom, size_t record, size_t size) {
  const uint16_t crc = crc16_bitwise(&eeprom[record + 1], size - 3);
  eeprom[record + size - 2] = static_cast<uint8_t>(crc);
  eeprom[record + size - 1] = static_cast<uint8_t>(crc >> 8);
}

size_t copy_written(const saved &s) { return s.writes.front().address; }
size_t other_copy(const saved &s) { return copy_written(s) == COPIES[0] ? COPIES[1] : COPIES[0]; }

void put_count(eeprom_image &eeprom, size_t entry, uint32_t count) {
  const size_t record = RING + entry * ENTRY_SIZE;
  eeprom[record] = VALID;
  eeprom[record + 1] = 0;
  for (size_t i = 0; i < 4; i++) {
    eeprom[record + 2 + i] = static_cast<uint8_t>(count >> 8 * i);
  }
  put_crc(eeprom, record, ENTRY_SIZE);
}

/* A ring whose newest entry says `count`. */
eeprom_image ring_of(uint32_t count) {
  eeprom_image eeprom;
  eeprom.fill(0xFF);
  for (uint32_t back = 0; back < ENTRIES && back < count; back++) {
    put_count(eeprom, (count - 1 - back) % ENTRIES, count - back);
  }
  return eeprom;
}

uint32_t boots_after_start(const eeprom_image &eeprom) {
  memory_bench bench(eeprom);
  return storage_boot_counter();
}

}  // namespace

TEST_CASE("an empty EEPROM gives the defaults") {
  memory_bench bench;
  bench.power_on();
  CHECK_FALSE(storage_parameters_loaded());
  CHECK(parameters_get(PARAMETER_BANDGAP) == 1100);
  CHECK(storage_boot_counter() == 1);
}

TEST_CASE("what was saved is in force after the next start, what was only set is not") {
  const saved s = save_twice();
  CHECK(s.first != s.defaults);
  CHECK(s.second != s.first);
  CHECK(after_start(s.once) == s.first);
  CHECK(after_start(s.twice) == s.second);
  CHECK(storage_parameters_loaded());
  memory_bench bench(s.twice);
  choose(0);
  bench.reset(RESET_CAUSE_EXTERNAL);
  CHECK(in_force() == s.second);
}

TEST_CASE("a save writes a cell in every other slot") {
  memory_bench bench;
  bench.power_on();
  bench.run(5 * TICK);
  const uint64_t begin = bench.machine.now;
  REQUIRE(save(bench) == ANSWER_STATUS_OK);
  REQUIRE(bench.writes.size() == COPY_SIZE + 1); /* the mark twice */
  CHECK(bench.machine.now - begin <= bench.writes.size() * TICK / 2 + 4 * TICK);
}

TEST_CASE("of three hundred saves the latest counts, whatever the generation") {
  memory_bench bench;
  bench.power_on();
  for (int i = 0; i < 300; i++) { /* it is one byte */
    const values chosen = choose(i % 3);
    REQUIRE(save(bench) == ANSWER_STATUS_OK);
    bench.reset(RESET_CAUSE_EXTERNAL);
    REQUIRE(in_force() == chosen);
  }
}

TEST_CASE("power cut at any cell of a save: all old or all new, and the next save works") {
  const saved s = save_twice();
  REQUIRE(s.writes.size() == COPY_SIZE + 1);
  int old_ones = 0, new_ones = 0;
  for (const eeprom_write &write : s.writes) {
    CHECK(write.address != 0); /* the cell that suffers when the supply fails */
    for (const eeprom_image &image : cut(write)) {
      CAPTURE(write.address);
      const values found = after_start(image);
      REQUIRE((found == s.first || found == s.second));
      CHECK(storage_parameters_loaded());
      (found == s.first ? old_ones : new_ones)++;

      memory_bench bench(image);
      const values third = choose(0);
      REQUIRE(save(bench) == ANSWER_STATUS_OK);
      bench.power_on();
      REQUIRE(in_force() == third);
    }
  }
  CHECK(old_ones > 350);
  CHECK(new_ones >= 1); /* the cut came after the last cell had its value */
}

TEST_CASE("power cut in a save that follows a cut save") {
  const saved s = save_twice();
  for (size_t i = 0; i < s.writes.size(); i += 5) {
    const eeprom_image image = cut(s.writes[i])[i % 9];
    memory_bench bench(image);
    const values old = in_force();
    REQUIRE((old == s.first || old == s.second));
    const values chosen = choose(0);
    REQUIRE(save(bench) == ANSWER_STATUS_OK);
    const std::vector<eeprom_write> writes = bench.writes;
    for (const eeprom_write &write : writes) {
      for (const eeprom_image &again : cut(write)) {
        const values found = after_start(again);
        /* What the first cut left may be whole but for its mark, which the second one may give it. */
        REQUIRE((found == old || found == chosen || found == s.second));
      }
    }
  }
}

TEST_CASE("the second copy matters: without it the same cuts lose everything") {
  const saved s = save_twice();
  const size_t other = other_copy(s);
  int lost = 0;
  for (const eeprom_write &write : s.writes) {
    for (eeprom_image image : cut(write)) {
      image[other] = 0xFF;
      const values found = after_start(image);
      lost += found != s.first && found != s.second;
    }
  }
  CHECK(lost > 350);
}

TEST_CASE("mark and CRC matter: to a board that looks at neither the same cuts give mixed values") {
  const saved s = save_twice();
  const size_t copy = copy_written(s);
  int with_crc = 0, with_neither = 0;
  for (const eeprom_write &write : s.writes) {
    for (eeprom_image image : cut(write)) {
      image[copy] = VALID;
      image[copy + 1] = s.twice[copy + 1]; /* generation: it would count */
      values found = after_start(image);
      with_crc += found != s.first && found != s.second;
      put_crc(image, copy, COPY_SIZE);
      found = after_start(image);
      with_neither += found != s.first && found != s.second;
    }
  }
  CHECK(with_crc == 0);
  CHECK(with_neither > 50);
}

TEST_CASE("the mark matters alone: a mixture whose CRC happens to match is refused while it is void") {
  const saved s = save_twice();
  const eeprom_write &middle = s.writes[s.writes.size() / 2];
  eeprom_image image = middle.before;
  const size_t copy = copy_written(s);
  put_crc(image, copy, COPY_SIZE);
  CHECK(after_start(image) == s.first);
  image[copy] = VALID;
  const values mixed = after_start(image);
  CHECK(mixed != s.first);
  CHECK(mixed != s.second);
}

TEST_CASE("a wrong bit anywhere in the newer copy brings the older one back") {
  const saved s = save_twice();
  const size_t copy = copy_written(s);
  for (size_t i = 0; i < COPY_SIZE; i++) {
    for (int bit = 0; bit < 8; bit++) {
      eeprom_image image = s.twice;
      image[copy + i] = static_cast<uint8_t>(image[copy + i] ^ 1 << bit);
      CAPTURE(i);
      CHECK(after_start(image) == s.first);
    }
  }
}

TEST_CASE("a copy of other parameters is not used") {
  const saved s = save_twice();
  eeprom_image image = s.twice;
  for (const size_t copy : COPIES) {
    image[copy + 2] = static_cast<uint8_t>(image[copy + 2] ^ 1);
    put_crc(image, copy, COPY_SIZE);
  }
  CHECK(after_start(image) == s.defaults);
  CHECK_FALSE(storage_parameters_loaded());
  for (const size_t copy : COPIES) { /* it was the hash and nothing else */
    image[copy + 2] = static_cast<uint8_t>(image[copy + 2] ^ 1);
    put_crc(image, copy, COPY_SIZE);
  }
  CHECK(after_start(image) == s.second);
}

TEST_CASE("a copy with a value out of its range is not used") {
  const saved s = save_twice();
  const size_t copy = copy_written(s);
  eeprom_image image = s.twice;
  const size_t place = copy + 4 + 2 * PARAMETER_BANDGAP;
  image[place] = static_cast<uint8_t>(1201 & 0xFF);
  image[place + 1] = 1201 >> 8;
  put_crc(image, copy, COPY_SIZE);
  CHECK(after_start(image) == s.first);
  image[other_copy(s)] = 0xFF;
  CHECK(after_start(image) == s.defaults);
  image[place] = static_cast<uint8_t>(1200 & 0xFF);
  put_crc(image, copy, COPY_SIZE);
  CHECK(after_start(image) != s.defaults);
  CHECK(parameters_get(PARAMETER_BANDGAP) == 1200);
}

TEST_CASE("a reset while a cell is written: its write goes on, and the copies stay as safe") {
  const saved s = save_twice();
  for (uint64_t delay = 0; delay < 40; delay++) {
    memory_bench bench(s.once);
    choose(2);
    REQUIRE(storage_save() == ANSWER_STATUS_OK);
    bench.run(delay * 5 * MILLISECOND);
    bench.reset(RESET_CAUSE_WATCHDOG);
    const values found = in_force();
    REQUIRE((found == s.first || found == s.second));
    const values third = choose(0);
    REQUIRE(save(bench) == ANSWER_STATUS_OK);
    bench.reset(RESET_CAUSE_EXTERNAL);
    CHECK(in_force() == third);
  }
}

TEST_CASE("a cell that does not take its value fails the save") {
  const saved s = save_twice();
  for (size_t i = 0; i < s.writes.size(); i++) {
    memory_bench bench(s.once);
    choose(2);
    REQUIRE(storage_save() == ANSWER_STATUS_OK);
    const uint16_t worn = s.writes[i].address;
    const uint8_t stuck = static_cast<uint8_t>(~s.writes[i].value);
    for (int step = 0; step < 400 && storage_busy(); step++) {
      bench.run(MILLISECOND);
      if (!bench.machine.eeprom_writing || bench.machine.eeprom_address != worn) {
        bench.machine.eeprom[worn] = stuck;
      }
    }
    REQUIRE_FALSE(storage_busy());
    CAPTURE(worn);
    CHECK(storage_result() == ANSWER_STATUS_STORAGE_FAILED);
    bench.power_on();
    CHECK(in_force() == s.first);
  }
}

TEST_CASE("while the supply is low nothing is written") {
  const saved s = save_twice();
  memory_bench bench(s.once);
  bench.volts = 3.9;
  bench.run(5 * TICK);
  REQUIRE(supply_low());
  CHECK(storage_save() == ANSWER_STATUS_SUPPLY_LOW);
  CHECK_FALSE(storage_busy());
  bench.run(11 * SECOND); /* nor the boot counter */
  CHECK(bench.writes.empty());
  bench.volts = 5.0;
  bench.run(1 * SECOND);
  CHECK(bench.writes.size() == ENTRY_SIZE + 1);
  bench.power_on();
  CHECK(storage_boot_counter() == 2);
}

TEST_CASE("a save during which the supply falls is given up, at any cell; what was saved stays") {
  const saved s = save_twice();
  for (uint64_t tick = 0; tick < 12; tick++) {
    memory_bench bench(s.once);
    bench.run(3 * TICK);
    choose(2);
    bench.writes.clear();
    REQUIRE(storage_save() == ANSWER_STATUS_OK);
    bench.run(tick * TICK);
    bench.volts = 3.9;
    bench.run(4 * TICK);
    CAPTURE(tick);
    REQUIRE(supply_low());
    CHECK_FALSE(storage_busy());
    CHECK(storage_result() == ANSWER_STATUS_SUPPLY_LOW);
    CHECK(bench.writes.size() < COPY_SIZE);
    bench.writes.clear();
    bench.run(SECOND);
    CHECK(bench.writes.empty());
    CHECK(after_start(bench.eeprom()) == s.first);
  }
}

TEST_CASE("a start counts when it has run for 10 s") {
  memory_bench bench;
  bench.power_on();
  bench.run(9990 * MILLISECOND);
  CHECK(bench.writes.empty());
  bench.power_on();
  CHECK(storage_boot_counter() == 1);
  bench.run(10100 * MILLISECOND);
  CHECK(storage_boot_counter() == 1); /* of this start, as long as it runs */
  bench.run(SECOND);
  CHECK(bench.writes.size() == ENTRY_SIZE + 1);
  bench.power_on();
  CHECK(storage_boot_counter() == 2);
  CHECK(bench.eeprom() == ring_of(1));
}

TEST_CASE("a boot counter's write that meets a save waits for it, and the other way round") {
  for (uint64_t before : {9900, 9990, 10000, 10010, 10020}) {
    memory_bench bench;
    bench.power_on();
    bench.run(before * MILLISECOND);
    const values chosen = choose(1);
    REQUIRE(save(bench) == ANSWER_STATUS_OK);
    bench.run(200 * MILLISECOND);
    CHECK(bench.writes.size() == COPY_SIZE + 1 + ENTRY_SIZE + 1);
    bench.power_on();
    CHECK(in_force() == chosen);
    CHECK(storage_boot_counter() == 2);
  }
}

TEST_CASE("power cut at any cell of a boot counter's write: never back, never garbage") {
  for (const uint32_t count : {0u, 1u, 15u, 16u, 31u, 255u, 256u, 65535u, 65536u, 0xFFFFFFu}) {
    memory_bench bench(ring_of(count));
    REQUIRE(storage_boot_counter() == count + 1);
    bench.run_blind(9990 * MILLISECOND);
    bench.run(100 * MILLISECOND);
    const std::vector<eeprom_write> writes = bench.writes;
    REQUIRE(writes.size() == ENTRY_SIZE + 1);
    for (const eeprom_write &write : writes) {
      for (const eeprom_image &image : cut(write)) {
        const uint32_t found = boots_after_start(image);
        CAPTURE(count);
        CAPTURE(write.address);
        REQUIRE((found == count + 1 || found == count + 2));
      }
    }
    CHECK(boots_after_start(bench.eeprom()) == count + 2);
  }
}

TEST_CASE("ring and CRC of the boot counter matter") {
  memory_bench bench(ring_of(255));
  bench.run_blind(9990 * MILLISECOND);
  bench.run(100 * MILLISECOND);
  const std::vector<eeprom_write> writes = bench.writes;
  int lost = 0, wrong = 0;
  for (const eeprom_write &write : writes) {
    for (eeprom_image image : cut(write)) {
      eeprom_image single = image; /* one entry alone */
      for (size_t entry = 0; entry < ENTRIES; entry++) {
        if (RING + entry * ENTRY_SIZE != writes.front().address) {
          single[RING + entry * ENTRY_SIZE] = 0xFF;
        }
      }
      lost += boots_after_start(single) < 256u;
      image[writes.front().address] = VALID; /* neither mark nor CRC */
      put_crc(image, writes.front().address, ENTRY_SIZE);
      const uint32_t found = boots_after_start(image);
      wrong += found != 256u && found != 257u;
    }
  }
  CHECK(lost > 50);
  CHECK(wrong > 5);
}

TEST_CASE("an entry of the ring that does not take its value is passed over") {
  eeprom_image eeprom = ring_of(20);
  for (int boot = 0; boot < 40; boot++) {
    memory_bench bench(eeprom);
    REQUIRE(storage_boot_counter() == 21u + static_cast<uint32_t>(boot));
    bench.run_blind(9990 * MILLISECOND);
    for (int step = 0; step < 600; step++) {
      bench.run(MILLISECOND / 2);
      bench.machine.eeprom[RING + 5 * ENTRY_SIZE + 3] = 0x77;
    }
    eeprom = bench.eeprom();
  }
}

TEST_CASE("wear: the entries of the ring take turns") {
  std::map<uint16_t, int> worn;
  memory_bench bench;
  for (int boot = 0; boot < 5 * static_cast<int>(ENTRIES); boot++) {
    bench.power_on();
    REQUIRE(storage_boot_counter() == static_cast<uint32_t>(boot + 1));
    bench.run_blind(9990 * MILLISECOND);
    bench.writes.clear();
    bench.run(80 * MILLISECOND);
    REQUIRE(bench.writes.size() == ENTRY_SIZE + 1);
    for (const eeprom_write &write : bench.writes) {
      worn[write.address]++;
    }
  }
  CHECK(worn.size() == ENTRIES * ENTRY_SIZE);
  for (const auto &[address, count] : worn) {
    CAPTURE(address);
    CHECK(count == (address % ENTRY_SIZE == 0 ? 10 : 5)); /* the mark twice in each */
  }
}
