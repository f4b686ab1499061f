/* 2 objects: ab, c; checksum 7c0c9b34.
 * Written by `palpate export`; not to be edited. */
#ifndef MODEL_MODEL_H
#define MODEL_MODEL_H

/* Parts of palpate.h that this model needs. For several models in one file: define these before including the first. */
#ifndef PALPATE_LAYOUTS
#define PALPATE_LAYOUTS PALPATE_COMPLETE
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
#ifndef PALPATE_MAX_OBJECTS
#define PALPATE_MAX_OBJECTS 2
#endif
#if defined(__AVR__) && !defined(PALPATE_BYTE)
#include <avr/pgmspace.h>
#define PALPATE_BYTE(p) pgm_read_byte(p)
#endif
#include "palpate.h"

#if (PALPATE_LAYOUTS & PALPATE_COMPLETE) == 0
#error "model MODEL: before the first model is included, #define PALPATE_LAYOUTS (PALPATE_COMPLETE | those of the others)"
#endif
#if (PALPATE_LEAVES & PALPATE_I8) == 0
#error "model MODEL: before the first model is included, #define PALPATE_LEAVES (PALPATE_I8 | those of the others)"
#endif
#if PALPATE_MAX_OBJECTS < 2
#error "model MODEL: before the first model is included, #define PALPATE_MAX_OBJECTS 2"
#endif

/* palpate_open(&model, model_model, sizeof model_model) */
static const uint8_t model_model[182]
#if defined(__AVR__)
    PROGMEM
#elif defined(__GNUC__)
    __attribute__((aligned(4)))
#endif
    = {
    80,76,80,84,1,0,1,0,182,0,0,0,1,0,1,1,2,0,2,0,
    2,0,0,0,3,0,0,0,5,0,0,0,0,0,128,60,41,59,170,184,
    5,0,0,0,0,0,0,0,235,87,10,212,250,149,2,0,200,0,0,0,
    0,0,192,63,0,0,32,65,11,0,0,0,0,0,0,0,0,0,0,0,
    7,0,0,0,12,0,0,0,12,0,0,0,0,0,0,0,5,48,46,49,
    46,48,2,97,98,1,99,32,0,0,0,224,255,255,255,0,0,0,0,0,
    0,0,0,0,1,3,2,1,2,1,1,233,3,0,112,17,1,253,1,0,
    0,0,1,0,0,0,2,0,0,0,1,0,0,0,1,0,0,1,1,0,
    0,1,0,0,0,0,136,128,120,132,192,64,192,64,160,144,96,128,52,155,
    12,124,
};

#endif
