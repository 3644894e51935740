// taxel-wire-1: frames that taxel reads without a board file. C++11, no memory but 270 bytes.
#pragma once
#include <stddef.h>
#include <stdint.h>
#include <string.h>

// Port has available(), read() and write(const uint8_t *, size_t), as Arduino's Serial.
// hello is JSON: what the values of a frame are, such as
//   {"name":"glove","firmware":"1.0","rate":"100 Hz","fields":[{"is":"value","name":"c1..c3","type":"i16"}]}
template <class Port>
class TaxelWire {
 public:
  TaxelWire(Port &port, const char *hello) : port_(port), hello_(hello) {}

  // Call it in each loop: a hello once a second until the computer writes, and when it asks.
  void poll(uint32_t now_ms) {
    bool asked = false;
    while (port_.available() > 0) {
      heard_ = true;
      asked = port_.read() == '?' || asked;
    }
    if (asked || (!heard_ && (now_ms - last_ms_ >= 1000 || !greeted_))) {
      greeted_ = true;
      last_ms_ = now_ms;
      packet(2, 0, 0, hello_, strlen(hello_));
    }
  }

  // One frame: the values in the order and of the type that the hello says.
  template <class Value>
  void frame(uint64_t time_us, const Value *values, size_t count) {
    packet(1, sequence++, time_us, values, count * sizeof(Value));
  }

  // A line for people.
  void text(const char *line) { packet(3, 0, 0, line, strlen(line)); }

  uint32_t sequence = 0;  // of the next frame

 private:
  void packet(uint8_t type, uint32_t sequence, uint64_t time_us, const void *body, size_t size) {
    crc_ = 0xffffffff;
    put(type);
    put(0);  // stream
    for (int i = 0; i < 4; i++) put(uint8_t(sequence >> (8 * i)));
    for (int i = 0; i < 8; i++) put(uint8_t(time_us >> (8 * i)));
    for (size_t i = 0; i < size; i++) put(static_cast<const uint8_t *>(body)[i]);
    const uint32_t crc = ~crc_;
    for (int i = 0; i < 4; i++) put(uint8_t(crc >> (8 * i)));
    flush();
    const uint8_t end = 0;
    port_.write(&end, 1);
  }

  // CRC-32/ISO-HDLC and consistent overhead byte stuffing, byte by byte.
  void put(uint8_t byte) {
    crc_ ^= byte;
    for (int i = 0; i < 8; i++) crc_ = (crc_ >> 1) ^ ((crc_ & 1) ? 0xedb88320 : 0);
    if (byte != 0) block_[++length_] = byte;
    if (byte == 0 || length_ == 254) flush();
  }

  void flush() {
    block_[0] = uint8_t(length_ + 1);
    port_.write(block_, length_ + 1);
    length_ = 0;
  }

  Port &port_;
  const char *hello_;
  uint8_t block_[255];
  size_t length_ = 0;
  uint32_t crc_ = 0, last_ms_ = 0;
  bool heard_ = false, greeted_ = false;
};
