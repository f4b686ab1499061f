/* A stream of rows of features on a Cortex-M0+: evidence adds up row by row, and a verdict comes as early as the model's promise
 * allows. docs/guide/streams.md says how sure.h (the model) and rows.h (rows to try it on) are made.
 *
 * One line for each sequence: the class, or -, and the rows that it took. */
#include "sure.h" /* includes palpate.h */
#include "rows.h" /* ROWS_FEATURES, rows_values, rows_starts, rows_sequences */
#include "bare.h" /* the emulated chip: where to write */

static void put(uintptr_t file, const char *text)
{
    size_t length = 0;
    while (text[length] != 0) {
        length++;
    }
    bare_move(BARE_WRITE, file, (void *)(uintptr_t)text, length);
}

static void put_number(uintptr_t file, uint32_t number)
{
    char text[12];
    int at = 11;
    text[at] = 0;
    do {
        text[--at] = (char)('0' + number % 10);
        number /= 10;
    } while (number != 0);
    put(file, text + at);
}

static int bare_main(void)
{
    const uintptr_t file = bare_open("verdicts.txt", 5);
    uint32_t sequence;
    for (sequence = 0; sequence < rows_sequences; sequence++) {
        palpate_recognizer state;
        uint32_t row, used = 0;
        int found = -1;
        sure_begin(&state);
        /* A row comes from a sensor; here from an array. */
        for (row = rows_starts[sequence]; row < rows_starts[sequence + 1] && found == -1; row++) {
            found = sure_push(&state, rows_values + row * ROWS_FEATURES);
            used++;
        }
        if (found >= 0) {
            put_number(file, (uint32_t)found);
        } else {
            put(file, "-");
        }
        put(file, " ");
        put_number(file, used);
        put(file, "\n");
    }
    return 0;
}
