/* Classes of rows, and ticks for the plain ones, on an emulated chip: qemu with -icount shift=0, where one instruction takes one
 * nanosecond and a tick of the timer 40. Each exporter's code stands behind peer_start and peer_class.
 *
 * It calls no routine of the compiler's or of newlib's: what it called would be in the empty image too, and missing from the
 * bytes of an exporter whose code calls it. So numbers are printed in hexadecimal, which takes no division. */
/* newlib's are measured, not the plain ones of bare.h. */
#if defined(__AVR__)
#include <avr/io.h>
#include <avr/pgmspace.h>
#include <stdint.h>
#define ROWS_IN PROGMEM
#else
#define memcpy bare_memcpy
#define memset bare_memset
#include "bare.h"
#undef memcpy
#undef memset
#define ROWS_IN
#endif
#include "rows.h" /* FEATURES, PLAIN, ROWS, rows[] */

int peer_start(void);
int peer_class(const float *row);

/* The time: ticks of 40 nanoseconds on a Cortex-M, instructions on RISC-V, ticks of 62.5 nanoseconds on an AVR. */
#if defined(__AVR__)
static uint32_t now(void)
{
    return TCNT1;
}
#define MASK 0xffff
#elif defined(__riscv)
static uint32_t now(void)
{
    uint32_t count;
    __asm__ volatile("csrr %0, minstret" : "=r"(count));
    return count;
}
#define MASK 0xffffffff
#else
#define SYSTICK ((volatile uint32_t *)0xe000e010)
static uint32_t now(void)
{
    return 0xffffff - SYSTICK[2];
}
#define MASK 0xffffff
#endif

static void say(const char *text)
{
#if defined(__AVR__)
    for (; *text != 0; text++) {
        while ((UCSR0A & _BV(UDRE0)) == 0) {
        }
        UDR0 = (uint8_t)*text;
    }
#else
    bare_ask(4, text);
#endif
}

static void print(uint32_t number)
{
    char text[10];
    int at = 9;
    text[at] = 0;
    text[--at] = ' ';
    do {
        text[--at] = "0123456789abcdef"[number & 15];
        number >>= 4;
    } while (number != 0);
    say(text + at);
}

static int bare_main(void);
static int bare_main(void)
{
    static uint8_t classes[ROWS];
    uint32_t ticks = 0, began;
    const float *values;
    int row;
#if defined(__AVR__)
    static float copy[FEATURES];
#endif
    if (peer_start() != 0) {
        return 1;
    }
#if defined(__AVR__)
    TCCR1B = _BV(CS10);
#elif defined(__arm__)
    SYSTICK[1] = 0xffffff;
    SYSTICK[0] = 5;
#endif
    for (row = 0; row < ROWS; row++) {
#if defined(__AVR__)
        memcpy_P(copy, rows + row * FEATURES, sizeof copy);
        values = copy;
#else
        values = rows + row * FEATURES;
#endif
        began = now();
        classes[row] = (uint8_t)peer_class(values);
        if (row < PLAIN) {
            ticks += (now() - began) & MASK;
        }
    }
    print(ticks);
    for (row = 0; row < ROWS; row++) {
        print(classes[row]);
    }
    say("\n");
    return 0;
}

#if defined(__AVR__)
int main(void)
{
    UCSR0B = _BV(TXEN0);
    bare_main();
    say(".");
    for (;;) {
    }
}
#endif
