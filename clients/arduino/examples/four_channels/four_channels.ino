// Four analog inputs at 100 Hz. On the computer: taxel live --raw --source serial:auto
#include <taxel_wire.h>

TaxelWire<decltype(Serial)> wire(Serial,
    "{\"name\":\"four channels\",\"firmware\":\"1.0\",\"rate\":\"100 Hz\","
    "\"fields\":[{\"is\":\"value\",\"name\":\"c1..c4\",\"type\":\"u16\"}]}");

void setup() { Serial.begin(921600); }

void loop() {
  static uint32_t next_us = 0;
  wire.poll(millis());
  if (int32_t(micros() - next_us) < 0) return;
  next_us += 10000;
  const uint16_t values[] = {uint16_t(analogRead(A0)), uint16_t(analogRead(A1)),
                             uint16_t(analogRead(A2)), uint16_t(analogRead(A3))};
  wire.frame(micros(), values, 4);
}
