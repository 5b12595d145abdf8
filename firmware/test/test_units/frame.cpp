/* Frames: the golden vectors, and what must not be accepted, by the board's build of frame.c and by the host's. */
#include <doctest.h>

#include <algorithm>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "generated/vectors.h"
#include "host_frame.h"
#include "link/crc21.h"
extern "C" {
#include "link/frame.h"
}

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

bool is_to_board(uint8_t id) { return message_length_to_board(id) >= 0; }

size_t length_of(uint8_t id) {
  return static_cast<size_t>(is_to_board(id) ? message_length_to_board(id) : message_length_to_host(id));
}

std::vector<received> decode(frame_decoder &decoder, const bytes &stream) {
  std::vector<received> found;
  for (uint8_t byte : stream) {
    if (frame_decode(&decoder, byte)) {
      const uint8_t *payload = frame_payload(&decoder);
      found.push_back(
          {frame_id(&decoder), frame_sequence(&decoder), bytes(payload, payload + length_of(frame_id(&decoder)))});
    }
  }
  return found;
}

std::vector<received> decode(host_decoder &decoder, const bytes &stream) {
  std::vector<received> found;
  for (uint8_t byte : stream) {
    if (host_decode(&decoder, byte)) {
      const uint8_t *payload = host_message_payload(&decoder);
      found.push_back({host_message_id(&decoder), host_message_sequence(&decoder),
                       bytes(payload, payload + length_of(host_message_id(&decoder)))});
    }
  }
  return found;
}

std::vector<received> at_board(const bytes &stream, uint32_t seed = FRAME_SEED) {
  frame_decoder decoder;
  frame_decoder_start(&decoder, seed);
  return decode(decoder, stream);
}

std::vector<received> at_host(const bytes &stream, uint32_t seed = FRAME_SEED) {
  host_decoder decoder;
  host_decoder_start(&decoder, seed);
  return decode(decoder, stream);
}

/* What the side that a message is meant for takes it for. */
std::vector<received> decode(const golden_frame &golden, const bytes &stream) {
  return is_to_board(golden.id) ? at_board(stream, golden.seed) : at_host(stream, golden.seed);
}

/* The first golden frame of each message. */
std::map<uint8_t, const golden_frame *> one_of_each() {
  std::map<uint8_t, const golden_frame *> found;
  for (const golden_frame &golden : GOLDEN_FRAMES) {
    found.emplace(golden.id, &golden);
  }
  return found;
}

/* Golden frames of the handshake to the board, one of each: all with the same seed. */
std::vector<const golden_frame *> handshake_to_board() {
  std::vector<const golden_frame *> found;
  for (const auto &entry : one_of_each()) {
    if (message_is_handshake(entry.first) && is_to_board(entry.first)) {
      found.push_back(entry.second);
    }
  }
  return found;
}

/* A frame around any stuffed bytes, right or not, with a right checksum. */
bytes wrap(const bytes &stuffed) {
  crc21 crc = crc21_start(FRAME_SEED);
  for (const uint8_t byte : stuffed) {
    crc21_add(&crc, byte);
  }
  uint8_t check[3];
  crc21_put(crc, check);
  bytes wire{0};
  wire.insert(wire.end(), stuffed.begin(), stuffed.end());
  wire.insert(wire.end(), check, check + sizeof check);
  wire.push_back(0);
  return wire;
}

}  // namespace

TEST_CASE("golden frames are made byte for byte, in both builds") {
  for (const golden_frame &golden : GOLDEN_FRAMES) {
    CAPTURE(golden.message);
    const bytes payload = from_hexadecimal(golden.payload);
    CHECK(encode(golden.id, golden.sequence, payload, golden.seed) == from_hexadecimal(golden.frame));
    bytes wire(FRAME_SIZE_MAX);
    wire.resize(host_frame_encode(wire.data(), golden.id, golden.sequence, payload.data(),
                                  static_cast<uint8_t>(payload.size()), golden.seed));
    CHECK(wire == from_hexadecimal(golden.frame));
  }
}

TEST_CASE("golden frames are read back by the side they are meant for, and refused by the other") {
  for (const golden_frame &golden : GOLDEN_FRAMES) {
    CAPTURE(golden.message);
    const bytes wire = from_hexadecimal(golden.frame);
    const std::vector<received> right = decode(golden, wire);
    REQUIRE(right.size() == 1);
    CHECK(right[0] == received{golden.id, golden.sequence, from_hexadecimal(golden.payload)});
    CHECK((is_to_board(golden.id) ? at_host(wire, golden.seed) : at_board(wire, golden.seed)).empty());
  }
}

TEST_CASE("a frame adds the stated overhead and has no zero inside") {
  for (const golden_frame &golden : GOLDEN_FRAMES) {
    const bytes payload = from_hexadecimal(golden.payload);
    const bytes wire = encode(golden.id, golden.sequence, payload, golden.seed);
    CHECK(wire.size() == payload.size() + FRAME_OVERHEAD);
    CHECK(wire.front() == 0);
    CHECK(wire.back() == 0);
    for (size_t i = 1; i + 1 < wire.size(); i++) {
      CHECK(wire[i] != 0);
    }
  }
}

TEST_CASE("any id, sequence number and payload is stuffed so that unstuffing gives it back") {
  std::mt19937 random(3);
  for (int round = 0; round < 4000; round++) {
    const auto id = static_cast<uint8_t>(random() % 3 == 0 ? 0 : random());
    const auto sequence = static_cast<uint8_t>(random() % 3 == 0 ? 0 : random());
    bytes content{id, sequence};
    const size_t length = random() % (FRAME_PAYLOAD_MAX + 1);
    for (size_t i = 0; i < length; i++) {
      content.push_back(static_cast<uint8_t>(random() % 4 == 0 ? random() : 0));
    }
    const bytes wire = encode(id, sequence, bytes(content.begin() + 2, content.end()));
    bytes unstuffed; /* as Cheshire and Baker describe it */
    for (size_t at = 1; at < wire.size() - 4; at += wire[at]) {
      unstuffed.insert(unstuffed.end(), wire.begin() + static_cast<std::ptrdiff_t>(at) + 1,
                       wire.begin() + static_cast<std::ptrdiff_t>(at) + wire[at]);
      unstuffed.push_back(0);
    }
    unstuffed.pop_back();
    CHECK(unstuffed == content);
  }
}

TEST_CASE("no frame with one or two wrong bits is accepted") {
  for (const auto &[id, golden] : one_of_each()) {
    bytes wire = from_hexadecimal(golden->frame);
    const size_t first = 8, last = 8 * (wire.size() - 1); /* bits between the delimiters */
    size_t accepted = 0;
    for (size_t one = first; one < last; one++) {
      wire[one / 8] ^= static_cast<uint8_t>(1u << one % 8);
      accepted += decode(*golden, wire).size();
      for (size_t two = one + 1; two < last; two++) {
        wire[two / 8] ^= static_cast<uint8_t>(1u << two % 8);
        accepted += decode(*golden, wire).size();
        wire[two / 8] ^= static_cast<uint8_t>(1u << two % 8);
      }
      wire[one / 8] ^= static_cast<uint8_t>(1u << one % 8);
    }
    CAPTURE(golden->message);
    CHECK(accepted == 0);
    CHECK(decode(*golden, wire).size() == 1);
  }
}

TEST_CASE("whatever is accepted from a mutated stream was sent") {
  std::mt19937 random(1);
  const std::vector<const golden_frame *> kinds = handshake_to_board();
  size_t wrong = 0, right = 0;
  for (int round = 0; round < 4000; round++) {
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
    for (const received &found : at_board(stream)) {
      const bool known = std::find(sent.begin(), sent.end(), found) != sent.end();
      right += known;
      wrong += !known;
    }
  }
  CHECK(wrong == 0);
  CHECK(right > 6000);
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
  CHECK(decoder.good == 3);
  CHECK(decoder.bad == 0);
  CHECK(decoder.resynchronised == 0);
}

TEST_CASE("one damaged frame costs no neighbour, and finding back is counted once") {
  const bytes one = from_hexadecimal(GOLDEN_FRAMES[0].frame);
  bytes damaged = one;
  damaged[3] ^= 1;
  bytes stream = one;
  stream.insert(stream.end(), damaged.begin(), damaged.end());
  stream.insert(stream.end(), damaged.begin(), damaged.end());
  stream.insert(stream.end(), one.begin(), one.end());
  stream.insert(stream.end(), one.begin(), one.end());
  frame_decoder decoder;
  frame_decoder_start(&decoder, FRAME_SEED);
  CHECK(decode(decoder, stream).size() == 3);
  CHECK(decoder.good == 3);
  CHECK(decoder.bad == 2);
  CHECK(decoder.resynchronised == 1);
}

TEST_CASE("the decoder's counts go on across 65535") {
  const bytes one = from_hexadecimal(GOLDEN_FRAMES[0].frame);
  bytes damaged = one;
  damaged[3] ^= 1;
  frame_decoder decoder;
  frame_decoder_start(&decoder, FRAME_SEED);
  decoder.good = decoder.bad = decoder.resynchronised = 0xFFFF;
  decode(decoder, one);
  CHECK(decoder.good == 0);
  decode(decoder, damaged);
  CHECK(decoder.bad == 0);
  decode(decoder, one);
  CHECK(decoder.resynchronised == 0);
}

TEST_CASE("the tail of a frame joined late is not counted as bad") {
  const bytes one = from_hexadecimal(GOLDEN_FRAMES[0].frame);
  bytes stream(one.begin() + 4, one.end());
  stream.insert(stream.end(), one.begin(), one.end());
  frame_decoder decoder;
  frame_decoder_start(&decoder, FRAME_SEED);
  CHECK(decode(decoder, stream).size() == 1);
  CHECK(decoder.bad == 0);
  CHECK(decoder.resynchronised == 0);
}

TEST_CASE("after a cut nothing counts until the next delimiter, and what comes then is heard") {
  const bytes one = from_hexadecimal(GOLDEN_FRAMES[0].frame);
  frame_decoder decoder;
  frame_decoder_start(&decoder, FRAME_SEED);
  decode(decoder, one);
  decode(decoder, bytes(one.begin(), one.begin() + 5));
  frame_decoder_cut(&decoder);
  CHECK(decode(decoder, bytes(one.begin() + 7, one.end())).empty());
  CHECK(decode(decoder, one).size() == 1);
  CHECK(decoder.good == 2);
  CHECK(decoder.bad == 0);
  CHECK(decoder.resynchronised == 0);
}

TEST_CASE("taking bytes only says where a piece ends; whether it is a message is judged apart") {
  bytes wire = from_hexadecimal(GOLDEN_FRAMES[0].frame);
  for (const bool damaged : {false, true}) {
    wire[3] = static_cast<uint8_t>(wire[3] ^ (damaged ? 1 : 0));
    frame_decoder decoder;
    frame_decoder_start(&decoder, FRAME_SEED);
    for (size_t i = 0; i < wire.size(); i++) {
      CHECK(frame_decoder_take(&decoder, wire[i]) == (i + 1 == wire.size()));
    }
    CHECK(decoder.good + decoder.bad == 0);
    CHECK(frame_decoder_accept(&decoder) == !damaged);
    CHECK(decoder.good + decoder.bad == 1);
  }
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
    for (size_t wrong = 0; wrong <= FRAME_PAYLOAD_MAX; wrong++) {
      const bytes wire = encode(id, 7, bytes(wrong, 1), golden->seed);
      CHECK(decode(*golden, wire).size() == (wrong == length ? 1u : 0u));
    }
  }
}

TEST_CASE("an unknown id is refused by both sides") {
  for (int id = 0; id < 256; id++) {
    for (uint8_t length = 0; length <= FRAME_PAYLOAD_MAX; length++) {
      const bytes wire = encode(static_cast<uint8_t>(id), 0, bytes(length, 1));
      if (message_length_to_board(static_cast<uint8_t>(id)) < 0) {
        CHECK(at_board(wire).empty());
      }
      if (message_length_to_host(static_cast<uint8_t>(id)) < 0) {
        CHECK(at_host(wire).empty());
      }
    }
  }
}

TEST_CASE("the stuffing must end exactly at the end") {
  const uint8_t id = MSG_SETPOINT_SIGNAL_ID;
  const bytes right{11, id, 200, 1, 1, 1, 1, 1, 1, 1, 1};
  REQUIRE(at_board(wrap(right)).size() == 1);
  for (uint8_t code = 1; code < 255; code++) {
    bytes stuffed = right;
    stuffed[0] = code;
    /* A code that points at a byte 1 makes that byte a zero, and a chain of 1s then ends at the end. */
    const bool ends = code == 11 || (code >= 3 && code < 11);
    CAPTURE(code);
    CHECK(at_board(wrap(stuffed)).size() == (ends ? 1u : 0u));
  }
}

TEST_CASE("the checksum's top bits must be set") {
  const bytes wire = from_hexadecimal(GOLDEN_FRAMES[0].frame);
  for (size_t i = wire.size() - 4; i < wire.size() - 1; i++) {
    bytes changed = wire;
    changed[i] &= 0x7F;
    CHECK(at_board(changed).empty());
  }
}

TEST_CASE("a session's seed keeps other sessions out, but not the handshake") {
  const uint32_t session = 0x0ABCDE;
  frame_decoder decoder;
  frame_decoder_start(&decoder, session);
  CHECK(decode(decoder, encode(MSG_STOP_ID, 0, {1}, session)).size() == 1);
  CHECK(decode(decoder, encode(MSG_STOP_ID, 0, {1}, session ^ 1)).empty());
  CHECK(decode(decoder, encode(MSG_STOP_ID, 0, {1}, FRAME_SEED)).empty());
  CHECK(decode(decoder, encode(MSG_IDENTIFY_ID, 0, {}, session)).size() == 1);
  CHECK(decode(decoder, encode(MSG_IDENTIFY_ID, 0, {}, FRAME_SEED)).size() == 1);
  for (int id = 0; id < 256; id++) {
    const bool same = encode(static_cast<uint8_t>(id), 1, {1}, session) == encode(static_cast<uint8_t>(id), 1, {1});
    CHECK(same == message_is_handshake(static_cast<uint8_t>(id)));
  }
}

TEST_CASE("without a session only the handshake is accepted, whatever seed a frame was made with") {
  for (const golden_frame &golden : GOLDEN_FRAMES) {
    const bytes payload = from_hexadecimal(golden.payload);
    for (uint32_t seed : {UINT32_C(0), static_cast<uint32_t>(FRAME_SEED), static_cast<uint32_t>(FRAME_NO_SESSION)}) {
      const bytes wire = encode(golden.id, golden.sequence, payload, seed);
      const size_t found = at_board(wire, FRAME_NO_SESSION).size() + at_host(wire, FRAME_NO_SESSION).size();
      CHECK(found == (message_is_handshake(golden.id) ? 1u : 0u));
    }
  }
}
