/* Commands on models, touches and rows, played through palpate.h; what comes out is text, which
 * tests/tests/whole/c_header.rs compares with what the crate gives; numbers in hexadecimal digits. No library: the same
 * for this machine and for bare chips.
 *
 * Commands, numbers little endian:
 *   M u32 length, bytes      opens a model and starts a recognizer: "open ERROR PLACE"
 *   T 3 u32, u8, 6 i16       pushes a touch: times, whether it has a pose, direction and alignment
 *   R u16 count, i32 each    pushes a row of features
 *   Q u16 count, i32 each    pushes the measured features of the next row of a sequence: "guarded FEATURE" if it is not taken
 *   E u16 count, i32 each    pushes margins
 *   P                        the posterior of every object
 *   N                        the name of every object
 *   X                        forgets all touches
 * After a model that was refused, everything up to the next M is skipped. */
#ifndef PALPATE_REPLAY_H
#define PALPATE_REPLAY_H

#ifndef PALPATE_MAX_OBJECTS
#define PALPATE_MAX_OBJECTS 256
#endif
/* The most features of a model with a guard. */
#ifndef REPLAY_GUARDED
#define REPLAY_GUARDED 256
#endif
#ifndef PALPATE_SEQUENCES
#define PALPATE_SEQUENCES 1
#endif
#ifndef PALPATE_OUTPUTS
#define PALPATE_OUTPUTS 1
#endif
#include "palpate.h"

/* One byte of the commands; -1 at their end. */
static int replay_get(void);
static void replay_put(char byte);
/* Room for the bytes of a model, instead of the last one; exactly `length` of them may be touched. */
static uint8_t *replay_room(size_t length);

static palpate_model replay_model;
static palpate_recognizer replay_recognizer;
static int32_t replay_features[256], replay_margins[PALPATE_MAX_OBJECTS];
#if PALPATE_SEQUENCES
static palpate_last replay_last[REPLAY_GUARDED];
static uint32_t replay_rows;
#endif
/* Room for margins. */
#define REPLAY_ROOM (sizeof replay_margins / sizeof replay_margins[0])

static uint32_t replay_number(int bytes)
{
    uint32_t number = 0;
    int i;
    for (i = 0; i < bytes; i++) {
        number |= (uint32_t)(replay_get() & 255) << 8 * i;
    }
    return number;
}

static void replay_text(const char *text)
{
    while (*text != 0) {
        replay_put(*text++);
    }
}

/* In hexadecimal digits, which need no division: it would take a small chip most of its time. */
static void replay_u64(uint64_t number)
{
    int shift = 60;
    while (shift > 0 && number >> shift == 0) {
        shift -= 4;
    }
    for (; shift >= 0; shift -= 4) {
        replay_put("0123456789abcdef"[number >> shift & 15]);
    }
}

static void replay_i64(int64_t number)
{
    replay_put(' ');
    if (number < 0) {
        replay_put('-');
    }
    replay_u64(number < 0 ? 0u - (uint64_t)number : (uint64_t)number);
}

static void replay_hex(const uint8_t *bytes, size_t length)
{
    replay_put(' ');
    while (length-- != 0) {
        replay_put("0123456789abcdef"[*bytes >> 4]);
        replay_put("0123456789abcdef"[*bytes++ & 15]);
    }
}

static void replay_numbers(const char *word, const int32_t *numbers, uint16_t count)
{
    uint16_t i;
    replay_text(word);
    for (i = 0; i < count; i++) {
        replay_i64(numbers[i]);
    }
    replay_put('\n');
}

/* The bits of a value; which of the NaNs it is, is up to the machine. */
static void replay_float(float value)
{
    union {
        float value;
        uint32_t bits;
    } both;
    both.value = value;
    replay_i64(value != value ? -1 : (int64_t)both.bits);
}

/* Evidence and verdict now. */
static void replay_evidence(void)
{
    uint16_t i;
    replay_text("evidence");
    for (i = 0; i < replay_model.objects; i++) {
        replay_i64(replay_recognizer.evidence[i]);
    }
    replay_text("\nverdict");
    replay_i64(replay_recognizer.verdict);
    replay_i64(replay_recognizer.verdict == PALPATE_RECOGNIZED ? replay_recognizer.object : 0);
    replay_i64((int64_t)replay_recognizer.touches);
    replay_put('\n');
}

static void replay_name(uint16_t object)
{
    char name[256];
    const size_t length = palpate_object_name(&replay_model, object, name, sizeof name);
    replay_text("name");
    replay_hex((const uint8_t *)name, length);
    replay_i64((int64_t)length);
    replay_put('\n');
}

/* Numbers of a command, into the features; returns how many there are. */
static uint16_t replay_row(void)
{
    const uint16_t count = (uint16_t)replay_number(2);
    uint16_t i;
    for (i = 0; i < count; i++) {
        replay_features[i & 255] = (int32_t)replay_number(4);
    }
    return count;
}

/* Results of a touch or row with these features. */
static void replay_known(palpate_answer answer, uint16_t count)
{
    const uint16_t objects = replay_model.objects;
    if (answer != PALPATE_COUNTED) {
        replay_text("refused");
        replay_i64((int64_t)answer);
        replay_put('\n');
        return;
    }
    replay_numbers("features", replay_features, count);
    (void)palpate_margins_of(&replay_model, replay_features, count, replay_margins, REPLAY_ROOM);
    replay_numbers("margins", replay_margins, objects);
#if PALPATE_LEAVES & PALPATE_F32
    {
        static union {
            float sums[PALPATE_MAX_OBJECTS];
            uint32_t bits[PALPATE_MAX_OBJECTS];
        } both;
        uint16_t i;
        if (palpate_f32_margins_of(&replay_model, replay_features, count, both.sums, PALPATE_MAX_OBJECTS)) {
            replay_text("sums");
            for (i = 0; i < objects; i++) {
                /* The machine chooses among NaNs. */
                replay_i64((both.bits[i] & 0x7fffffffu) > 0x7f800000u ? -1 : (int64_t)both.bits[i]);
            }
            replay_put('\n');
        }
    }
#endif
    {
        /* A model of several outputs has no value. */
        const int has_value = objects == 1;
        const uint16_t class_number = palpate_predict_class(&replay_model, replay_features, count, replay_margins, REPLAY_ROOM);
        replay_text("predicted");
        replay_i64((int64_t)class_number);
        replay_float(has_value ? palpate_predict_raw(&replay_model, replay_features, count) : 0);
        replay_float(has_value ? palpate_predict_value(&replay_model, replay_features, count) : 0);
        replay_put('\n');
        replay_numbers("margins", replay_margins, objects);
    }
    replay_evidence();
}

#if PALPATE_SEQUENCES
/* Makes room for the number of the row among so many measured features, and pushes them. */
static void replay_next(uint16_t count)
{
    uint16_t i, refused;
    for (i = count; i < 256; i++) {
        replay_features[i] = PALPATE_MISSING_FEATURE;
    }
    for (i = 255; replay_model.position_ != NULL && i > PALPATE_BYTE(replay_model.position_); i--) {
        replay_features[i] = replay_features[i - 1];
    }
    refused = palpate_next_row(&replay_model, &replay_rows, replay_last, replay_features);
    if (refused != 0) {
        replay_text("guarded");
        replay_i64((int64_t)refused);
        replay_put('\n');
        return;
    }
    count = replay_model.features;
    replay_known(palpate_push_features(&replay_recognizer, replay_features, count), count);
}
#endif

static void replay_touch(int is_open)
{
    palpate_touch touch;
    palpate_answer answer;
    uint16_t count;
    int i;
    for (i = 0; i < 3; i++) {
        touch.times[i] = replay_number(4);
    }
    touch.has_pose = (uint8_t)replay_get();
    for (i = 0; i < 3; i++) {
        touch.direction[i] = (int16_t)(uint16_t)replay_number(2);
    }
    for (i = 0; i < 3; i++) {
        touch.alignment[i] = (int16_t)(uint16_t)replay_number(2);
    }
    if (is_open) {
        answer = palpate_push(&replay_recognizer, &touch);
        count = palpate_features(&replay_model, &touch, replay_features);
        if (answer == PALPATE_COUNTED) {
            /* Without a recognizer. */
            (void)palpate_margins(&replay_model, &touch, replay_margins, REPLAY_ROOM);
            replay_numbers("touch", replay_margins, replay_model.objects);
        }
        replay_known(answer, count);
    }
}

/* All commands. Returns 0 unless one is not known. */
static int replay(void)
{
    int is_open = 0, command;
    uint16_t i, count;
    size_t length, at;
    uint8_t *bytes;
    palpate_error error;
    while ((command = replay_get()) >= 0) {
        switch (command) {
        case 'M':
            length = (size_t)replay_number(4);
            bytes = replay_room(length);
            for (at = 0; at < length; at++) {
                bytes[at] = (uint8_t)replay_get();
            }
            error = palpate_open(&replay_model, bytes, length);
            if (error == PALPATE_OK) {
                error = palpate_start(&replay_recognizer, &replay_model);
            }
            is_open = error == PALPATE_OK;
#if PALPATE_SEQUENCES
            replay_rows = 0;
#endif
            replay_text("open");
            replay_i64((int64_t)error);
            replay_i64(is_open ? 0 : (int64_t)replay_model.wrong);
            replay_put('\n');
            break;
        case 'T':
            replay_touch(is_open);
            break;
        case 'R':
            count = replay_row();
            if (is_open) {
                replay_known(palpate_push_features(&replay_recognizer, replay_features, count), count);
            }
            break;
#if PALPATE_SEQUENCES
        case 'Q':
            count = replay_row();
            if (is_open) {
                replay_next(count);
            }
            break;
#endif
        case 'E':
            count = replay_row();
            if (is_open) {
                palpate_push_margins(&replay_recognizer, replay_features, count);
                replay_evidence();
            }
            break;
        case 'P':
            if (is_open) {
                replay_text("best");
                replay_i64(palpate_best(&replay_recognizer));
                replay_text("\nposteriors");
                for (i = 0; i <= replay_model.objects; i++) {
                    replay_put(' ');
                    replay_u64(palpate_posterior(&replay_recognizer, i));
                }
#if PALPATE_OUTPUTS
                if (replay_model.outputs_ != NULL) {
                    replay_text("\ntogether");
                    for (i = 0; i <= replay_model.objects; i++) {
                        uint64_t share;
                        const uint64_t posterior = palpate_posterior_together(&replay_recognizer, i, &share);
                        replay_put(' ');
                        replay_u64(posterior);
                        replay_put(' ');
                        replay_u64(share);
                    }
                }
#endif
                replay_put('\n');
            }
            break;
        case 'N':
            for (i = 0; is_open && i <= replay_model.objects; i++) {
                replay_name(i);
            }
            if (is_open) {
                replay_name(UINT16_MAX);
            }
            break;
        case 'X':
            if (is_open) {
                palpate_reset(&replay_recognizer);
#if PALPATE_SEQUENCES
                replay_rows = 0;
#endif
            }
            break;
        default:
            return 1;
        }
    }
    return 0;
}

#endif
