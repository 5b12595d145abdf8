/* Frames: the golden vectors, and what must not be accepted. */
#include <doctest.h>

#include <algorithm>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "../vectors.h"
#include "link/frame.h"

namespace {

using bytes = std::vector<uint8_t>;

bytes from_hexadecimal(const std::string &text) {
  bytes result;
  for (size_t i = 0; i + 1 < text.size(); i += 2) {
    result.push_back(static_cast<uint8_t>(std::stoi(text.substr(i, 2), nullptr, 16)));
  }
  return result;
}

bytes encode(uint8_t id, uint8_t sequence, const bytes &payload, uint32_t seed = FRAME_SEED) {
  bytes wire(FRAME_SIZE_MAX);
  wire.resize(frame_encode(wire.data(), id, sequence, payload.data(), static_cast<uint8_t>(payload.size()), seed));
  return wire;
}

struct received {
  uint8_t id, sequence;
  bytes payload;
  bool operator==(const received &other) const {
    return id == other.id && sequence == other.sequence && payload == other.payload;
  }
};

std::vector<received> decode(frame_decoder &decoder, const bytes &stream) {
  std::vector<received> found;
  for (uint8_t byte : stream) {
    if (frame_decode(&decoder, byte)) {
      const uint8_t *payload = frame_payload(&decoder);
      found.push_back(
          {frame_id(&decoder), frame_sequence(&decoder), bytes(payload, payload + message_length(frame_id(&decoder)))});
    }
  }
  return found;
}

std::vector<received> decode(const bytes &stream) {
  frame_decoder decoder;
  frame_decoder_start(&decoder, FRAME_SEED);
  return decode(decoder, stream);
}

/* The first golden frame of each message. */
std::map<uint8_t, const golden_frame *> one_of_each() {
  std::map<uint8_t, const golden_frame *> found;
  for (const golden_frame &golden : GOLDEN_FRAMES) {
    found.emplace(golden.id, &golden);
  }
  return found;
}

/* A frame around any stuffed bytes, right or not, with a right checksum. */
bytes wrap(const bytes &stuffed) {
  const uint32_t check = frame_checksum(FRAME_SEED, stuffed.data(), static_cast<uint8_t>(stuffed.size()));
  bytes wire{0};
  wire.insert(wire.end(), stuffed.begin(), stuffed.end());
  for (int shift = 14; shift >= 0; shift -= 7) {
    wire.push_back(static_cast<uint8_t>(0x80 | (check >> shift & 0x7F)));
  }
  wire.push_back(0);
  return wire;
}

}  // namespace

TEST_CASE("golden frames are made byte for byte") {
  for (const golden_frame &golden : GOLDEN_FRAMES) {
    CAPTURE(golden.message);
    CHECK(encode(golden.id, golden.sequence, from_hexadecimal(golden.payload)) == from_hexadecimal(golden.frame));
  }
}

TEST_CASE("golden frames are read back") {
  for (const golden_frame &golden : GOLDEN_FRAMES) {
    CAPTURE(golden.message);
    const std::vector<received> found = decode(from_hexadecimal(golden.frame));
    REQUIRE(found.size() == 1);
    CHECK(found[0] == received{golden.id, golden.sequence, from_hexadecimal(golden.payload)});
  }
}

TEST_CASE("a frame adds the stated overhead and has no zero inside") {
  for (const golden_frame &golden : GOLDEN_FRAMES) {
    const bytes payload = from_hexadecimal(golden.payload);
    const bytes wire = encode(golden.id, golden.sequence, payload);
    CHECK(wire.size() == payload.size() + FRAME_OVERHEAD);
    CHECK(wire.front() == 0);
    CHECK(wire.back() == 0);
    for (size_t i = 1; i + 1 < wire.size(); i++) {
      CHECK(wire[i] != 0);
    }
  }
}

TEST_CASE("no frame with one or two wrong bits is accepted") {
  for (const auto &[id, golden] : one_of_each()) {
    bytes wire = from_hexadecimal(golden->frame);
    const size_t first = 8, last = 8 * (wire.size() - 1); /* bits between the delimiters */
    size_t accepted = 0;
    for (size_t one = first; one < last; one++) {
      wire[one / 8] ^= static_cast<uint8_t>(1u << one % 8);
      accepted += decode(wire).size();
      for (size_t two = one + 1; two < last; two++) {
        wire[two / 8] ^= static_cast<uint8_t>(1u << two % 8);
        accepted += decode(wire).size();
        wire[two / 8] ^= static_cast<uint8_t>(1u << two % 8);
      }
      wire[one / 8] ^= static_cast<uint8_t>(1u << one % 8);
    }
    CAPTURE(golden->message);
    CHECK(accepted == 0);
    CHECK(decode(wire).size() == 1);
  }
}

TEST_CASE("whatever is accepted from a mutated stream was sent") {
  std::mt19937 random(1);
  std::vector<const golden_frame *> kinds;
  for (const auto &entry : one_of_each()) {
    kinds.push_back(entry.second);
  }
  size_t wrong = 0, right = 0;
  for (int round = 0; round < 20000; round++) {
    bytes stream;
    std::vector<received> sent;
    for (int i = 0; i < 3; i++) {
      const golden_frame &golden = *kinds[random() % kinds.size()];
      const bytes wire = from_hexadecimal(golden.frame);
      stream.insert(stream.end(), wire.begin(), wire.end());
      sent.push_back({golden.id, golden.sequence, from_hexadecimal(golden.payload)});
    }
    const size_t at = random() % stream.size();
    switch (random() % 4) {
      case 0:
        stream.erase(stream.begin() + static_cast<std::ptrdiff_t>(at));
        break;
      case 1:
        stream.insert(stream.begin() + static_cast<std::ptrdiff_t>(at), static_cast<uint8_t>(random()));
        break;
      case 2:
        stream[at] = static_cast<uint8_t>(random());
        break;
      default:
        stream.resize(at);
        break;
    }
    for (const received &found : decode(stream)) {
      const bool known = std::find(sent.begin(), sent.end(), found) != sent.end();
      right += known;
      wrong += !known;
    }
  }
  CHECK(wrong == 0);
  CHECK(right > 30000);
}

TEST_CASE("neighbours may share a delimiter, and empty frames are nothing") {
  const bytes one = from_hexadecimal(GOLDEN_FRAMES[0].frame);
  bytes stream = one;
  stream.insert(stream.end(), one.begin() + 1, one.end());
  stream.insert(stream.end(), 5, 0);
  stream.insert(stream.end(), one.begin(), one.end());
  frame_decoder decoder;
  frame_decoder_start(&decoder, FRAME_SEED);
  CHECK(decode(decoder, stream).size() == 3);
  CHECK(decoder.bad == 0);
}

TEST_CASE("one damaged frame costs no neighbour") {
  const bytes one = from_hexadecimal(GOLDEN_FRAMES[0].frame);
  bytes damaged = one;
  damaged[3] ^= 1;
  bytes stream = one;
  stream.insert(stream.end(), damaged.begin(), damaged.end());
  stream.insert(stream.end(), one.begin(), one.end());
  frame_decoder decoder;
  frame_decoder_start(&decoder, FRAME_SEED);
  CHECK(decode(decoder, stream).size() == 2);
  CHECK(decoder.bad == 1);
}

TEST_CASE("the tail of a frame joined late is not counted as bad") {
  const bytes one = from_hexadecimal(GOLDEN_FRAMES[0].frame);
  bytes stream(one.begin() + 4, one.end());
  stream.insert(stream.end(), one.begin(), one.end());
  frame_decoder decoder;
  frame_decoder_start(&decoder, FRAME_SEED);
  CHECK(decode(decoder, stream).size() == 1);
  CHECK(decoder.bad == 0);
}

TEST_CASE("constant noise without a delimiter does not stop the decoder") {
  bytes stream{0};
  stream.insert(stream.end(), 10000, 0x55);
  const bytes one = from_hexadecimal(GOLDEN_FRAMES[0].frame);
  stream.insert(stream.end(), one.begin(), one.end());
  frame_decoder decoder;
  frame_decoder_start(&decoder, FRAME_SEED);
  CHECK(decode(decoder, stream).size() == 1);
  CHECK(decoder.bad == 1);
}

TEST_CASE("the length must be exactly that of the id") {
  for (const auto &[id, golden] : one_of_each()) {
    const size_t length = from_hexadecimal(golden->payload).size();
    for (size_t wrong = 0; wrong <= MESSAGE_PAYLOAD_MAX; wrong++) {
      const bytes wire = encode(id, 7, bytes(wrong, 1));
      CHECK(decode(wire).size() == (wrong == length ? 1u : 0u));
    }
  }
}

TEST_CASE("an unknown id is refused") {
  for (int id = 0; id < 256; id++) {
    if (message_length(static_cast<uint8_t>(id)) < 0) {
      CHECK(decode(encode(static_cast<uint8_t>(id), 0, {})).empty());
    }
  }
}

TEST_CASE("the stuffing must end exactly at the end") {
  const uint8_t id = MSG_SETPOINT_SIGNAL_ID;
  const bytes right{11, id, 200, 1, 1, 1, 1, 1, 1, 1, 1};
  REQUIRE(decode(wrap(right)).size() == 1);
  for (uint8_t code = 1; code < 255; code++) {
    bytes stuffed = right;
    stuffed[0] = code;
    /* A code that points at a byte 1 makes that byte a zero, and a chain of 1s then ends at the end. */
    const bool ends = code == 11 || (code >= 3 && code < 11);
    CAPTURE(code);
    CHECK(decode(wrap(stuffed)).size() == (ends ? 1u : 0u));
  }
}

TEST_CASE("the checksum's top bits must be set") {
  const bytes wire = from_hexadecimal(GOLDEN_FRAMES[0].frame);
  for (size_t i = wire.size() - 4; i < wire.size() - 1; i++) {
    bytes changed = wire;
    changed[i] &= 0x7F;
    CHECK(decode(changed).empty());
  }
}

TEST_CASE("a session's seed keeps other sessions out, but not the handshake") {
  const uint32_t session = 0x0ABCDE;
  frame_decoder decoder;
  frame_decoder_start(&decoder, session);
  CHECK(decode(decoder, encode(MSG_STOP_ID, 0, {}, session)).size() == 1);
  CHECK(decode(decoder, encode(MSG_STOP_ID, 0, {}, FRAME_SEED)).empty());
  CHECK(decode(decoder, encode(MSG_IDENTIFY_ID, 0, {}, session)).size() == 1);
  CHECK(decode(decoder, encode(MSG_IDENTIFY_ID, 0, {}, FRAME_SEED)).size() == 1);
  CHECK(encode(MSG_HELLO_REQUEST_ID, 0, {1}, session) == encode(MSG_HELLO_REQUEST_ID, 0, {1}, FRAME_SEED));
}
