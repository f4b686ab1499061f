/* Classes of rows, and ticks for the plain ones, on an emulated chip: qemu with -icount shift=0, where one instruction takes one
 * nanosecond and a tick of the timer 40. Each exporter's code stands behind peer_start and peer_class.
 *
 * It calls no routine of the compiler's or of newlib's: what it called would be in the empty image too, and missing from the
 * bytes of an exporter whose code calls it. So numbers are printed in hexadecimal, which takes no division. */
/* newlib's are measured, not the plain ones of bare.h. */
#define memcpy bare_memcpy
#define memset bare_memset
#include "bare.h"
#undef memcpy
#undef memset
#include "rows.h" /* FEATURES, PLAIN, ROWS, rows[] */

int peer_start(void);
int peer_class(const float *row);

/* The time: ticks of 40 nanoseconds on a Cortex-M, instructions on RISC-V. */
#if defined(__riscv)
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
    bare_ask(4, text + at);
}

static int bare_main(void)
{
    static uint8_t classes[ROWS];
    uint32_t ticks = 0, began;
    int row;
    if (peer_start() != 0) {
        return 1;
    }
#if defined(__arm__)
    SYSTICK[1] = 0xffffff;
    SYSTICK[0] = 5;
#endif
    for (row = 0; row < ROWS; row++) {
        began = now();
        classes[row] = (uint8_t)peer_class(rows + row * FEATURES);
        if (row < PLAIN) {
            ticks += (now() - began) & MASK;
        }
    }
    print(ticks);
    for (row = 0; row < ROWS; row++) {
        print(classes[row]);
    }
    bare_ask(4, "\n");
    return 0;
}
