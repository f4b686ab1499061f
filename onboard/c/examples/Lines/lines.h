/* Touches as lines of text, "0 1200 -": when each finger touched, in microseconds, or - for one that did not. */
#ifndef LINES_H
#define LINES_H

#include <stdio.h>
#include <stdlib.h>

#ifdef MODEL_FILE /* the bytes of model.palpate, which the build puts into flash; define what the model needs */
#include "palpate.h"
extern const uint8_t MODEL_FILE[], MODEL_FILE_END[];
#define LINES_MODEL MODEL_FILE
#define LINES_SIZE ((uint32_t)(MODEL_FILE_END - MODEL_FILE))
#else
#include "model.h"
#define LINES_MODEL model_model
#define LINES_SIZE ((uint32_t)sizeof model_model)
#endif

static palpate_model model;
static palpate_recognizer recognizer;

/* Opens the model; 0 if it is one. */
static int lines_begin(void)
{
    return palpate_open(&model, LINES_MODEL, LINES_SIZE) != PALPATE_OK || palpate_start(&recognizer, &model) != PALPATE_OK;
}

/* Counts the touch of a line and writes the answer, of at most `size` bytes. */
static void lines_answer(const char *line, char *answer, size_t size)
{
    palpate_touch touch = {{0, 0, 0}, 0, {0, 0, 0}, {0, 0, 0}};
    int finger;
    for (finger = 0; finger < 3; finger++) {
        char *end = NULL;
        while (*line == ' ') {
            line++;
        }
        touch.times[finger] = PALPATE_MISSING;
        if (*line == '-') {
            line++;
            continue;
        }
        /* strtoul would take a sign. */
        if (*line >= '0' && *line <= '9') {
            touch.times[finger] = (uint32_t)strtoul(line, &end, 10);
        }
        if (end == NULL) {
            snprintf(answer, size, "three times in microseconds, or -, such as: 0 1200 -");
            return;
        }
        line = end;
    }
    if (palpate_push(&recognizer, &touch) != PALPATE_COUNTED) {
        snprintf(answer, size, "The model was not trained on such touches.");
        return;
    }
    switch (recognizer.verdict) {
    case PALPATE_UNDECIDED:
        snprintf(answer, size, "undecided");
        return;
    case PALPATE_RECOGNIZED:
        palpate_object_name(&model, recognizer.object, answer, size);
        break;
    case PALPATE_UNKNOWN:
        snprintf(answer, size, "unknown");
        break;
    default:
        snprintf(answer, size, "gave up");
        break;
    }
    palpate_reset(&recognizer);
}

#endif
