// Writes a hello, the frame of the specification, a text and a long frame to standard output.
#include <stdio.h>

#include "taxel_wire.h"

struct Output {
  int asked = 0;
  int available() { return asked; }
  int read() { asked--; return '?'; }
  size_t write(const uint8_t *bytes, size_t size) { return fwrite(bytes, 1, size, stdout); }
};

int main() {
  Output output;
  TaxelWire<Output> wire(
      output, "{\"name\":\"vector\",\"fields\":[{\"is\":\"value\",\"name\":\"c1..c3\",\"type\":\"i16\"}]}");
  output.asked = 1;
  wire.poll(0);
  // Heard and not asked: no more of them.
  wire.poll(5000);
  wire.sequence = 7;
  const int16_t values[] = {1, -1, 256};
  wire.frame(1000, values, 3);
  wire.text("ready");
  int32_t many[150];
  for (int i = 0; i < 150; i++) many[i] = 0x01010101 * (i % 100 + 1);
  wire.frame(0x0102030405060708, many, 150);
}
