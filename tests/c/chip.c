/* replay.h on a bare chip: the host's file `commands` in, its file `results` out. */
#include "bare.h"
#include "replay.h"

static uint8_t in[4096], out[4096];
static size_t in_length, in_at, out_length;
static uintptr_t commands, results;

static int replay_get(void)
{
    if (in_at == in_length) {
        in_length = sizeof in - (size_t)bare_move(BARE_READ, commands, in, sizeof in);
        in_at = 0;
        if (in_length == 0) {
            return -1;
        }
    }
    return in[in_at++];
}

static void flush(void)
{
    bare_move(BARE_WRITE, results, out, out_length);
    out_length = 0;
}

static void replay_put(char byte)
{
    if (out_length == sizeof out) {
        flush();
    }
    out[out_length++] = (uint8_t)byte;
}

/* At an odd address: a Cortex-M0+ must not load more than a byte at once from it. */
static uint8_t *replay_room(size_t length)
{
    static uint32_t room[50000];
    return length < sizeof room ? (uint8_t *)room + 1 : NULL;
}

static int bare_main(void)
{
    int answer;
    commands = bare_open("commands", 1);
    results = bare_open("results", 5);
    answer = replay();
    flush();
    bare_move(BARE_CLOSE, results, NULL, 0);
    return answer;
}
