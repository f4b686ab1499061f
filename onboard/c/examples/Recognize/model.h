/* 2 objects: ab, c; checksum 20997fc5.
 * Written by `palpate export`; not to be edited. */
/* From features to margins: at most 977 instructions on a Cortex-M4F, 1,353 on a Cortex-M0+, estimated.
 * Flash: 173 bytes for the model's array, and the functions that are called. RAM: the stack, and a palpate_recognizer for
 * each stream; nothing is static. */
#ifndef MODEL_MODEL_H
#define MODEL_MODEL_H

/* Parts of palpate.h that this model needs. For several models in one file: define these before including the first. */
#ifndef PALPATE_LAYOUTS
#define PALPATE_LAYOUTS PALPATE_COMPACT
#endif
#ifndef PALPATE_LEAVES
#define PALPATE_LEAVES PALPATE_I8
#endif
#ifndef PALPATE_STRANGERS
#define PALPATE_STRANGERS 0
#endif
#ifndef PALPATE_SHARED
#define PALPATE_SHARED 0
#endif
#ifndef PALPATE_SENTINEL
#define PALPATE_SENTINEL 0
#endif
#ifndef PALPATE_ROW_EVIDENCE
#define PALPATE_ROW_EVIDENCE 0
#endif
#ifndef PALPATE_MAX_OBJECTS
#define PALPATE_MAX_OBJECTS 2
#endif
#if defined(__AVR__) && !defined(PALPATE_BYTE)
#include <avr/pgmspace.h>
#define PALPATE_BYTE(p) pgm_read_byte(p)
#endif
#include "palpate.h"

#if (PALPATE_LAYOUTS & PALPATE_COMPACT) == 0
#error "model MODEL: before the first model is included, #define PALPATE_LAYOUTS (PALPATE_COMPACT | those of the others)"
#endif
#if (PALPATE_LEAVES & PALPATE_I8) == 0
#error "model MODEL: before the first model is included, #define PALPATE_LEAVES (PALPATE_I8 | those of the others)"
#endif
#if PALPATE_MAX_OBJECTS < 2
#error "model MODEL: before the first model is included, #define PALPATE_MAX_OBJECTS 2"
#endif

/* palpate_open(&model, model_model, sizeof model_model) */
static const uint8_t model_model[173]
#if defined(__AVR__)
    PROGMEM
#elif defined(__GNUC__)
    __attribute__((aligned(4)))
#endif
    = {
    80,76,80,84,3,0,0,0,173,0,0,0,1,0,1,1,2,0,1,0,
    2,0,0,0,3,0,0,0,5,0,0,0,0,0,128,60,41,59,170,184,
    5,0,0,0,0,0,0,0,235,87,10,212,250,149,2,0,200,0,0,0,
    0,0,192,63,0,0,32,65,11,0,0,0,0,0,0,0,0,0,0,0,
    7,0,0,0,13,0,0,0,10,0,0,0,0,0,0,0,5,48,46,49,
    46,48,2,97,98,1,99,32,0,0,0,224,255,255,255,0,0,0,0,0,
    0,0,0,0,1,3,2,1,2,1,1,233,3,0,112,17,1,253,0,0,
    0,0,2,0,0,0,1,0,0,1,0,2,0,0,0,0,1,0,0,136,
    128,120,132,192,64,160,144,96,128,197,127,153,32,
};

/* The model as palpate_open leaves it: its bytes were checked when it was exported. */
static const palpate_model model_opened_ = {
    model_model,
    {model_model + 96, model_model + 107, model_model + 107, model_model + 123, model_model + 138, model_model + 146, model_model + 159, model_model + 169},
    model_model + 131, NULL, NULL, NULL, NULL, NULL, NULL, 0, 0u,
#if PALPATE_SEQUENCES
    NULL, NULL,
#endif
#if PALPATE_OUTPUTS
    NULL,
#endif
    0, 4294967295u, 2, 2, 2, 0, 0, 1, 0, 32, 0
#if PALPATE_LAYOUTS & PALPATE_CODE
    , NULL
#endif
};

enum {
    MODEL_CLASS_AB = 0, /* ab */
    MODEL_CLASS_C = 1, /* c */
};

/* Begins: nothing was added yet. Threads and interrupts may call it at once, each with a state of its own. */
static inline void model_begin(palpate_recognizer *state)
{
    palpate_start_(state, &model_opened_);
}

/* Adds a step by its three times in microseconds, PALPATE_MISSING for one that there is not: the index of the object that is recognized; -1 while none is, -2 if none fits, -3 at the limit of steps. After a decision nothing changes until model_begin. Threads and interrupts may call it at once, each with a state of its own. */
static inline int model_push(palpate_recognizer *state, const uint32_t *times)
{
    return palpate_add_times_(state, times);
}

/* The decision at the end, or without one the object with the most evidence; -1 if nothing was added. Threads and interrupts may call it at once, each with a state of its own. */
static inline int model_end(const palpate_recognizer *state)
{
    return palpate_ended_(state);
}

/* PALPATE_OK if the model's bytes have their checksum, else PALPATE_CHECKSUM. Any threads and interrupts may call it at once. */
static inline palpate_error model_check(void)
{
    return palpate_check_(&model_opened_);
}

#endif
