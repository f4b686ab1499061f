/* replay.h on an emulated ATmega2560: commands, of another file, in flash; results over the UART, with a 0 at their end. */
#include <avr/io.h>
#include <avr/pgmspace.h>
#include <stddef.h>
#include <stdint.h>

#define PALPATE_MAX_OBJECTS 12
#define REPLAY_GUARDED 64
#include "replay.h"

extern const uint8_t commands[];
extern const uint32_t commands_length;

static uint32_t at;

static int replay_get(void)
{
    return at < commands_length ? (int)pgm_read_byte_far(pgm_get_far_address(commands) + at++) : -1;
}

static void replay_put(char byte)
{
    while ((UCSR0A & _BV(UDRE0)) == 0) {
    }
    UDR0 = (uint8_t)byte;
}

static uint8_t *replay_room(size_t length)
{
    static uint8_t model[3200];
    return length <= sizeof model ? model : NULL;
}

int main(void)
{
    UCSR0B = _BV(TXEN0);
    replay();
    replay_put(0);
    for (;;) {
    }
}
