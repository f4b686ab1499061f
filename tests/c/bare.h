/* A bare chip in QEMU, without any library: where it starts, files of the host by semihosting, and what compilers call. */
#ifndef PALPATE_BARE_H
#define PALPATE_BARE_H

#include <stddef.h>
#include <stdint.h>

enum { BARE_OPEN = 1, BARE_CLOSE = 2, BARE_WRITE = 5, BARE_READ = 6, BARE_EXIT = 0x18, BARE_EXIT_EXTENDED = 0x20 };

/* Asks the emulator. */
static uintptr_t bare_ask(uintptr_t what, const void *with)
{
#if defined(__arm__)
    register uintptr_t r0 __asm__("r0") = what;
    register const void *r1 __asm__("r1") = with;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
#else
    register uintptr_t a0 __asm__("a0") = what;
    register const void *a1 __asm__("a1") = with;
    __asm__ volatile(".option push\n.option norvc\n.balign 16\nslli x0, x0, 0x1f\nebreak\nsrai x0, x0, 7\n.option pop"
                     : "+r"(a0)
                     : "r"(a1)
                     : "memory");
    return a0;
#endif
}

/* A file of the host: `mode` 1 reads, 5 writes. */
static uintptr_t bare_open(const char *name, uintptr_t mode)
{
    uintptr_t arguments[3];
    size_t length = 0;
    while (name[length] != 0) {
        length++;
    }
    arguments[0] = (uintptr_t)name;
    arguments[1] = mode;
    arguments[2] = length;
    return bare_ask(BARE_OPEN, arguments);
}

/* Reads or writes; returns how many bytes are left. */
static uintptr_t bare_move(uintptr_t what, uintptr_t file, void *bytes, size_t length)
{
    uintptr_t arguments[3];
    arguments[0] = file;
    arguments[1] = (uintptr_t)bytes;
    arguments[2] = length;
    return bare_ask(what, arguments);
}

static int bare_main(void);

static void bare_begin(void)
{
    uintptr_t arguments[2];
    arguments[0] = 0x20026; /* the program ended by itself */
    arguments[1] = (uintptr_t)bare_main();
    bare_ask(BARE_EXIT_EXTENDED, arguments);
    for (;;) {
    }
}

#if defined(__arm__)
void start(void);
void start(void)
{
#if defined(__ARM_FP)
    *(volatile uint32_t *)0xe000ed88 |= 0xf00000; /* the floating-point unit is off at first */
#endif
    bare_begin();
}

/* A fault must not look like an end. */
void bare_fault(void);
void bare_fault(void)
{
    uintptr_t arguments[2];
    arguments[0] = 0x20023;
    arguments[1] = 3;
    bare_ask(BARE_EXIT_EXTENDED, arguments);
    for (;;) {
    }
}

__asm__(".section .vectors, \"a\"\n.word stack_top, start, bare_fault, bare_fault, bare_fault, bare_fault, bare_fault\n.previous");
#else
void bare_reset(void);
void bare_reset(void)
{
    bare_begin();
}
__asm__(".section .vectors, \"ax\"\n.global start\nstart:\nla sp, stack_top\nj bare_reset\n.previous");
#endif

/* A compiler may call these in any program. */
void *memcpy(void *to, const void *from, size_t length);
void *memcpy(void *to, const void *from, size_t length)
{
    volatile uint8_t *target = (volatile uint8_t *)to;
    const uint8_t *source = (const uint8_t *)from;
    while (length-- != 0) {
        *target++ = *source++;
    }
    return to;
}

void *memset(void *to, int byte, size_t length);
void *memset(void *to, int byte, size_t length)
{
    volatile uint8_t *target = (volatile uint8_t *)to;
    while (length-- != 0) {
        *target++ = (uint8_t)byte;
    }
    return to;
}

#endif
