/* Calls of a program that recognizes: its size is what recognition takes. -DROWS: rows of features instead of touches;
 * -DEVERYTHING: posteriors and names as well. */
#include "palpate.h"

extern palpate_model model;
extern palpate_recognizer recognizer;
int begin(const uint8_t *bytes, size_t length);

palpate_model model;
palpate_recognizer recognizer;

int begin(const uint8_t *bytes, size_t length)
{
    return palpate_open(&model, bytes, length) != PALPATE_OK || palpate_start(&recognizer, &model) != PALPATE_OK;
}

#ifdef ROWS
int recognize(const int32_t *features);
int recognize(const int32_t *features)
{
    return palpate_push_features(&recognizer, features, model.features) == PALPATE_COUNTED ? recognizer.verdict : -1;
}
#else
int recognize(const palpate_touch *touch);
int recognize(const palpate_touch *touch)
{
    return palpate_push(&recognizer, touch) == PALPATE_COUNTED ? recognizer.verdict : -1;
}
#endif

#ifdef EVERYTHING
uint64_t posterior(uint16_t object);
uint64_t posterior(uint16_t object)
{
    return palpate_posterior(&recognizer, object);
}

size_t name(char *text, size_t room);
size_t name(char *text, size_t room)
{
    return palpate_object_name(&model, recognizer.object, text, room);
}

int32_t key(float value);
int32_t key(float value)
{
    return palpate_f32_key(value);
}

void margins(const palpate_touch *touch, int32_t *sums);
void margins(const palpate_touch *touch, int32_t *sums)
{
    (void)palpate_margins(&model, touch, sums, PALPATE_MAX_OBJECTS);
}

void reset(void);
void reset(void)
{
    palpate_reset(&recognizer);
}

#if PALPATE_LEAVES & PALPATE_F32
int sums(const int32_t *features, float *margins);
int sums(const int32_t *features, float *margins)
{
    return palpate_f32_margins_of(&model, features, model.features, margins, PALPATE_MAX_OBJECTS);
}
#endif
#endif
