/* Trees as code against margins that the layouts of data give: on this machine, or on an emulated chip. models.h, which a test
 * writes, has models, rows and margins. Says how many rows of each model differ; 0 of all is right. With COUNT it says instead
 * how many instructions a row of the first model takes, under qemu -icount shift=0 on Arm. */
#include "models.h"

#if defined(__AVR__)
#include <avr/io.h>
static void put(char byte)
{
    while ((UCSR0A & _BV(UDRE0)) == 0) {
    }
    UDR0 = (uint8_t)byte;
}
#elif defined(BARE)
#include "bare.h"
static void put(char byte)
{
    char text[2];
    text[0] = byte;
    text[1] = 0;
    bare_ask(4, text);
}
#else
#include <stdio.h>
static void put(char byte)
{
    putchar(byte);
}
#endif

static void number(unsigned value)
{
    if (value > 9) {
        number(value / 10);
    }
    put((char)('0' + value % 10));
}

/* Rows of a model whose margins differ: those of its function, and those that palpate.h gives. */
static unsigned differences(const struct code_test *test)
{
    static int32_t margins[256];
    unsigned row, wrong = 0;
    palpate_model model;
    const int fails = test->open(&model) != PALPATE_OK;
    for (row = 0; row < test->rows; row++) {
        const int32_t *expected = test->expected + row * test->objects;
        int differs = fails;
        unsigned i;
        test->margins(test->values + row * test->features, margins);
        for (i = 0; i < test->objects; i++) {
            differs |= margins[i] != expected[i];
            margins[i] = 0;
        }
        differs |= palpate_margins_of(&model, test->keys + row * test->features, (uint16_t)test->features, margins, 256) != PALPATE_OK;
        for (i = 0; i < test->objects; i++) {
            differs |= margins[i] != expected[i];
        }
        differs |= test->class_of != 0 && test->class_of(test->values + row * test->features) != test->classes[row];
        wrong += differs != 0;
    }
    return wrong;
}

#if defined(COUNT)
/* One instruction takes one nanosecond: 40 of them are a tick of a timer of 25 MHz, of 24 bits, that counts down. */
#define SYSTICK ((volatile uint32_t *)0xe000e010)

static int test(void)
{
    static int32_t margins[256];
    void (*volatile function)(const void *, int32_t *) = tests[0].margins;
    unsigned row, round;
    uint32_t began;
    SYSTICK[1] = 0xffffff;
    SYSTICK[2] = 0;
    SYSTICK[0] = 5;
    began = SYSTICK[2];
    for (round = 0; round < 8; round++) {
        for (row = 0; row < tests[0].rows; row++) {
            function(tests[0].values + row * tests[0].features, margins);
        }
    }
    number((unsigned)(((began - SYSTICK[2]) & 0xffffff) * 5 / tests[0].rows));
    put('\n');
    return 0;
}
#else
static int test(void)
{
    unsigned i;
    for (i = 0; i < sizeof tests / sizeof tests[0]; i++) {
        number(differences(&tests[i]));
        put(' ');
    }
    put('.');
    put('\n');
    return 0;
}
#endif

#if defined(__AVR__)
int main(void)
{
    UCSR0B = _BV(TXEN0);
    test();
    for (;;) {
    }
}
#elif defined(BARE)
static int bare_main(void)
{
    return test();
}
#else
int main(void)
{
    return test();
}
#endif
