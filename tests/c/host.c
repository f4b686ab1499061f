/* replay.h on this machine: commands from standard input, results to standard output. */
#include "replay.h"
#include <stdio.h>
#include <stdlib.h>

static int replay_get(void)
{
    return getchar();
}

static void replay_put(char byte)
{
    putchar(byte);
}

/* At an odd address, so that a load of more than a byte which some machines forbid is found. */
static uint8_t *replay_room(size_t length)
{
    static void *room;
    free(room);
    room = malloc(length + 1);
    if (room == NULL) {
        exit(2);
    }
    return (uint8_t *)room + 1;
}

int main(void)
{
    return replay();
}
