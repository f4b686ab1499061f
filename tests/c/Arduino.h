/* Stub with as much of Arduino as the example needs, so that a compiler can check it. The Arduino program includes its own. */
#ifndef ARDUINO_H
#define ARDUINO_H

#include <stdint.h>

enum { LOW = 0, HIGH = 1, INPUT_PULLUP = 2 };
struct Printer {
    void begin(unsigned long baud);
    void print(const char *text);
    void println(const char *text);
    void println(unsigned long number);
};
extern Printer Serial;
void pinMode(uint8_t pin, uint8_t mode);
int digitalRead(uint8_t pin);
uint32_t micros();

#endif
