// The example with what Arduino gives: 3 s of it, to standard output.
#include <stdint.h>
#include <stdio.h>

struct FakeSerial {
  void begin(long) {}
  int available() { return 0; }
  int read() { return -1; }
  size_t write(const uint8_t *bytes, size_t size) { return fwrite(bytes, 1, size, stdout); }
} Serial;

static uint32_t now_us = 0;
enum { A0, A1, A2, A3 };
uint32_t micros() { return now_us; }
uint32_t millis() { return now_us / 1000; }
int analogRead(int pin) { return pin; }

#include "examples/four_channels/four_channels.ino"

int main() {
  setup();
  for (; now_us < 3000000; now_us += 500) loop();
}
