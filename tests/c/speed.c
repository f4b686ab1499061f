/* Instructions per row or touch of the model in the host's file `model`, under qemu -icount shift=0, which lets one instruction
 * take one nanosecond: 40 of them are a tick of a timer of 25 MHz (Arm), 100 one of 10 MHz (RISC-V). */
#include "bare.h"
#include "palpate.h"

static uint8_t bytes[1000000];
static palpate_model model;
static palpate_recognizer recognizer;

#if defined(__arm__)
enum { NANOSECONDS = 40 };
#define SYSTICK ((volatile uint32_t *)0xe000e010)
static uint32_t ticks(void)
{
    SYSTICK[1] = 0xffffff;
    SYSTICK[0] = 5;
    return 0xffffff - SYSTICK[2];
}
#else
enum { NANOSECONDS = 100 };
static uint32_t ticks(void)
{
    return *(volatile uint32_t *)0x200bff8;
}
#endif

static void print(const char *what, uint32_t number)
{
    static const char digits[] = "0123456789";
    char text[12];
    int at = 11;
    text[at] = 0;
    do {
        text[--at] = digits[number % 10];
        number /= 10;
    } while (number != 0);
    bare_ask(4, what);
    bare_ask(4, text + at);
    bare_ask(4, "\n");
}

static uint32_t draw(uint32_t *state)
{
    *state = *state * 1664525u + 1013904223u;
    return *state >> 8;
}

static int bare_main(void)
{
    const uintptr_t file = bare_open("model", 1);
    const size_t length = sizeof bytes - (size_t)bare_move(BARE_READ, file, bytes, sizeof bytes);
    int32_t features[256], margins[PALPATE_MAX_OBJECTS];
    uint32_t state = 1, began, sums = 0, pushes = 0, opened;
    int round, i;
    began = ticks();
    if (palpate_open(&model, bytes, length) != PALPATE_OK || palpate_start(&recognizer, &model) != PALPATE_OK) {
        return 1;
    }
    opened = (ticks() - began) & 0xffffff;
    for (round = 0; round < 1000; round++) {
        palpate_touch touch = {{0, 0, 0}, 1, {0, 0, -32767}, {32767, 0, 0}};
        for (i = 0; i < 3; i++) {
            touch.times[i] = draw(&state) % 150000;
        }
        if (model.descriptor == 255) {
            for (i = 0; i < model.features; i++) {
                features[i] = model.real != 0 ? palpate_f32_key((float)(draw(&state) % 2000) / 10.0f) : (int32_t)(draw(&state) % 200);
            }
        } else {
            palpate_features(&model, &touch, features);
        }
        began = ticks();
        (void)palpate_margins_of(&model, features, model.features, margins, PALPATE_MAX_OBJECTS);
        sums += (ticks() - began) & 0xffffff;
        palpate_reset(&recognizer);
        began = ticks();
        if (model.descriptor == 255) {
            palpate_push_features(&recognizer, features, model.features);
        } else {
            palpate_push(&recognizer, &touch);
        }
        pushes += (ticks() - began) & 0xffffff;
    }
    print("instructions for the margins of a row: ", sums * NANOSECONDS / 1000);
    print("instructions for a touch or row with its verdict: ", pushes * NANOSECONDS / 1000);
    print("thousand instructions to open: ", opened / (1000 / NANOSECONDS));
    return 0;
}
