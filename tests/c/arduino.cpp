/* An Arduino sketch on this machine: its clock goes on by 50 us whenever it is asked, its switches are what standard input
 * says, and what it prints and pushes goes to standard output. Input: the clock's value at the start, the microseconds
 * that all takes, and then the edges, each a pin, whether it closes, and when.
 *
 * SKETCH is the sketch; its model.h is in an include path. */
#include "Arduino.h"
#include "model.h"

#include <cinttypes>
#include <cstdio>

struct Edge {
    unsigned pin, closes;
    uint32_t at;
};
struct End {};

static uint32_t start, end, passed;
static bool began, has_edge;
static Edge edge;
static bool closed[5];

Printer Serial;
void Printer::begin(unsigned long) {}
void Printer::print(const char *text) { std::printf("%s", text); }
void Printer::println(const char *text) { std::printf("%s\n", text); }
void Printer::println(unsigned long number) { std::printf("%lu\n", number); }
void pinMode(uint8_t, uint8_t) {}

static void next_edge() { has_edge = std::scanf("%u %u %" SCNu32, &edge.pin, &edge.closes, &edge.at) == 3; }

uint32_t micros() {
    passed += began ? 50 : 0;
    began = true;
    if (passed > end) {
        throw End();
    }
    while (has_edge && edge.at <= passed) {
        closed[edge.pin] = edge.closes != 0;
        next_edge();
    }
    return start + passed;
}

/* To ground, against a pull-up. */
int digitalRead(uint8_t pin) { return closed[pin] ? LOW : HIGH; }

static palpate_answer push_and_print(palpate_recognizer *recognizer, const palpate_touch *touch) {
    std::printf("touch %" PRIu32 " %" PRIu32 " %" PRIu32 "\n", touch->times[0], touch->times[1], touch->times[2]);
    return palpate_push(recognizer, touch);
}
#define palpate_push push_and_print
#include SKETCH

int main() {
    if (std::scanf("%" SCNu32 " %" SCNu32, &start, &end) != 2) {
        return 1;
    }
    next_edge();
    try {
        setup();
        while (true) {
            loop();
        }
    } catch (const End &) {
    }
    return 0;
}
