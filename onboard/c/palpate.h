/* palpate.h: recognize objects by touch, or classify rows of features, with a model that `palpate export` wrote.
 *
 * One header in C99, also C++11 where unions are read as GCC, Clang and MSVC define it. No allocation, no library, no
 * floating point unless a model has f32 leaves, no undefined behavior for any bytes. It reads shared/FORMAT.md of Palpate,
 * and gives the same margins, evidence, verdicts and posteriors as the crate palpate-onboard, bit for bit.
 * Licensed as Palpate: MIT or Apache-2.0.
 *
 *     palpate_model model;
 *     palpate_recognizer recognizer;
 *     if (palpate_open(&model, bytes, length) != PALPATE_OK) { ... model.wrong is the place ... }
 *     palpate_start(&recognizer, &model);
 *     ...
 *     palpate_touch touch = {{30000, 0, 50000}, 0, {0, 0, 0}, {0, 0, 0}};
 *     if (palpate_push(&recognizer, &touch) == PALPATE_COUNTED && recognizer.verdict == PALPATE_RECOGNIZED) {
 *         ... recognizer.object ...
 *     }
 *
 * Rows of features have a class or a value in one call: palpate_predict_class, palpate_predict_value.
 *
 * Every function is `static inline`: include it in the one file that recognizes; only called functions take flash.
 *
 * Macros that may be defined before the #include:
 *   PALPATE_LAYOUTS      layouts to read, such as PALPATE_COMPACT; all of data by default
 *   PALPATE_LEAVES       types of leaves to read, such as PALPATE_I8; all by default
 *   PALPATE_SHARED       0: rejects models that store equal leaves once, in a table
 *   PALPATE_SENTINEL     0: rejects models over rows in which a number stands for a missing value
 *   PALPATE_ROW_EVIDENCE 0: rejects models that state what a row adds to the evidence, or how much rows count together
 *   PALPATE_SEQUENCES    1: reads models that number the rows of a sequence, or state which of them they take; rejected by default
 *   PALPATE_OUTPUTS      1: reads models in which several outputs belong to one object; rejected by default
 *   PALPATE_STRANGERS    0: rejects models with a test for unknown objects, or with a background
 *   PALPATE_MAX_OBJECTS  room of a recognizer, 1 to 256; 32 by default; each object takes state and stack
 *   PALPATE_BYTE(p)      reads the byte of a model at `p`: *(p) by default, pgm_read_byte(p) for an AVR's flash
 *   PALPATE_API          instead of `static inline`
 */
#ifndef PALPATE_H
#define PALPATE_H

#include <stddef.h>
#include <stdint.h>

/* Layouts. `palpate export` and `palpate inspect` say which one a model has. */
#define PALPATE_COMPACT 1
#define PALPATE_WIDE 2
#define PALPATE_CODE 4 /* trees that are a function, which `palpate export` wrote too: not among the layouts by default */
/* Types of leaves. */
#define PALPATE_I8 1
#define PALPATE_I16 2
#define PALPATE_F32 4

#ifndef PALPATE_LAYOUTS
#define PALPATE_LAYOUTS 3
#endif
#ifndef PALPATE_LEAVES
#define PALPATE_LEAVES 7
#endif
#ifndef PALPATE_SHARED
#define PALPATE_SHARED 1
#endif
#ifndef PALPATE_SENTINEL
#define PALPATE_SENTINEL 1
#endif
#ifndef PALPATE_ROW_EVIDENCE
#define PALPATE_ROW_EVIDENCE 1
#endif
#ifndef PALPATE_SEQUENCES
#define PALPATE_SEQUENCES 0
#endif
#ifndef PALPATE_OUTPUTS
#define PALPATE_OUTPUTS 0
#endif
#ifndef PALPATE_STRANGERS
#define PALPATE_STRANGERS 1
#endif
#ifndef PALPATE_MAX_OBJECTS
#define PALPATE_MAX_OBJECTS 32
#endif
#ifndef PALPATE_BYTE
#define PALPATE_BYTE(p) (*(p))
#endif
#ifndef PALPATE_API
#define PALPATE_API static inline
#endif
#if defined(__GNUC__)
#define PALPATE_NEAR_ static inline __attribute__((always_inline))
#define PALPATE_APART_ static __attribute__((noinline, unused))
#else
#define PALPATE_NEAR_ static inline
#define PALPATE_APART_ static inline
#endif
/* Converts a number to another type, or reinterprets its bytes. C++ has casts of its own, without a warning by
 * -Wold-style-cast. */
#if defined(__cplusplus)
#define PALPATE_AS_(type, value) static_cast<type>(value)
#define PALPATE_AT_(type, place) reinterpret_cast<type>(place)
#else
#define PALPATE_AS_(type, value) ((type)(value))
#define PALPATE_AT_(type, place) ((type)(place))
#endif
/* A number of four bytes is a single load on a chip that loads from any address, and a call on others. */
#if defined(__ARM_FEATURE_UNALIGNED) || defined(__x86_64__) || defined(__aarch64__)
#define PALPATE_U32_ PALPATE_NEAR_
#else
#define PALPATE_U32_ PALPATE_APART_
#endif

/* f32 values are added as f32. 16 and 32 say that only narrower types are evaluated in a wider one; -1 that nothing is known. */
#if PALPATE_LEAVES & PALPATE_F32
#include <float.h>
#if defined(FLT_EVAL_METHOD) && FLT_EVAL_METHOD != 0 && FLT_EVAL_METHOD != 16 && FLT_EVAL_METHOD != 32
#if defined(__i386__) || defined(_M_IX86)
#error "f32 leaves are added in f32, but this compiler may add in more: compile with -msse2 -mfpmath=sse, or export with --leaf i16 and leave PALPATE_F32 out of PALPATE_LEAVES"
#elif defined(__FAST_MATH__)
#error "f32 leaves are added in f32, but this compiler may add in more: compile without -ffast-math, or export with --leaf i16 and leave PALPATE_F32 out of PALPATE_LEAVES"
#elif defined(__GNUC__)
#error "f32 leaves are added in f32, but this compiler may add in more: compile with -std=gnu99 or -fexcess-precision=fast where that helps, or export with --leaf i16 and leave PALPATE_F32 out of PALPATE_LEAVES"
#else
#error "f32 leaves are added in f32, but this compiler may add in more: export with --leaf i16 and leave PALPATE_F32 out of PALPATE_LEAVES"
#endif
#endif
#endif

/* A contact that is missing. */
#define PALPATE_MISSING UINT32_MAX
/* A feature that is missing. */
#define PALPATE_MISSING_FEATURE INT32_MIN
/* No class, for lack of room for margins. */
#define PALPATE_NO_CLASS UINT16_MAX
/* The most features of a touch. */
#define PALPATE_TOUCH_FEATURES 10
/* 1 as a posterior. */
#define PALPATE_ONE (PALPATE_AS_(uint64_t, 1) << 56)

/* Reasons to reject bytes or a model. `wrong` of the model is the place of the error. */
typedef enum {
    PALPATE_OK = 0,
    PALPATE_LENGTH,          /* fewer bytes than the model has, or more */
    PALPATE_NOT_A_MODEL,     /* they do not start as a model does */
    PALPATE_VERSION,         /* a version of the format that this header does not know */
    PALPATE_CHECKSUM,        /* bytes were changed */
    PALPATE_FIELD,           /* a field has an invalid value */
    PALPATE_SECTION,         /* a section does not have its length */
    PALPATE_NOT_UNDERSTOOD,  /* a section that must be understood, and is not */
    PALPATE_MARGIN_RANGE,    /* margins could overflow */
    PALPATE_NOT_BUILT_IN,    /* not in PALPATE_LAYOUTS (place 6) or PALPATE_LEAVES (place 7) */
    PALPATE_TOO_MANY_OBJECTS, /* more than a recognizer (palpate_start, place 14) or a call has room for; none for palpate_open */
    PALPATE_NEEDS_CODE       /* its trees are a function, which palpate_open_code takes */
} palpate_error;

/* Reasons not to count a touch or a row. Nothing has changed. */
typedef enum {
    PALPATE_COUNTED = 0,
    PALPATE_REFUSED_PATTERN, /* the model was not trained on touches with these contacts */
    PALPATE_REFUSED_SPREAD,  /* the contacts are further apart than in any touch of the training */
    PALPATE_REFUSED_NO_POSE, /* the model needs the probe's pose */
    PALPATE_NEEDS_FEATURES,  /* the model is over rows of features */
    PALPATE_NEEDS_TOUCHES    /* the model is over touches */
} palpate_answer;

/* Verdicts. */
typedef enum {
    PALPATE_UNDECIDED = 0,
    PALPATE_RECOGNIZED, /* an object, until the reset */
    PALPATE_UNKNOWN,    /* the touches fit no object that the model knows, until the reset: by a misfit test */
    PALPATE_GAVE_UP     /* the limit of touches was reached, until the reset */
} palpate_verdict;

/* An approach: when each finger touched, in microseconds on any common clock, or PALPATE_MISSING; and the probe's pose if
 * `has_pose` is not 0: direction of motion, and from the first to the third finger, as cosines in Q15. */
typedef struct {
    uint32_t times[3];
    uint8_t has_pose;
    int16_t direction[3];
    int16_t alignment[3];
} palpate_touch;

/* A model that was opened. Its bytes are read in place and must stay. Names with _ at the end are not for users. */
typedef struct {
    const uint8_t *bytes;
    const uint8_t *part_[8]; /* starts of text, sections, margins, axes, groups, splits, leaves, checksum */
    const uint8_t *cuts_;    /* thresholds of the axes */
    const uint8_t *odds_;    /* thresholds by object, or NULL */
    const uint8_t *strangers_; /* its section on unknown objects, or NULL */
    const uint8_t *table_; /* values of the leaves that are shared, or NULL; before them the length of their numbers */
    const uint8_t *sentinel_; /* features that stand for a missing value, or NULL */
    const uint8_t *weights_; /* weights of evidence by the number of touches or rows, or NULL */
    const uint8_t *row_; /* table from a row's margins to evidence; NULL: the margins */
    int32_t row_start_;  /* the margin of that table's first value */
    uint32_t row_most_;  /* beyond it, up to the last one */
#if PALPATE_SEQUENCES
    const uint8_t *position_; /* the feature that is a row's number, or NULL */
    const uint8_t *guard_;    /* limits of each feature, or NULL */
#endif
#if PALPATE_OUTPUTS
    const uint8_t *outputs_; /* the objects that outputs belong to; NULL if each is an object */
#endif
    uint32_t wrong;          /* the place of the error, in bytes from the start */
    uint32_t largest_spread; /* of touches that count, in microseconds */
    uint16_t objects;        /* number of objects with margins, 1 to 256 */
    uint16_t known;          /* number that can be named: all, or all but the last, a background */
    uint16_t features;       /* number in a row, 1 to 256 */
    uint8_t layout_;
    uint8_t leaf_;
    uint8_t descriptor; /* 255: rows of features */
    uint8_t real;       /* 1: features are keys of f32 values, see palpate_key */
    uint8_t patterns;   /* contact patterns that count, bit by code */
    uint8_t needs_pose;
#if PALPATE_LAYOUTS & PALPATE_CODE
    void (*code)(const int32_t *features, int32_t *margins);
#endif
} palpate_model;

/* State of recognition of the object that is touched. */
typedef struct {
    const palpate_model *model;
    uint64_t odds;        /* threshold: largest weight of the others, in Q56; for objects without their own */
    uint32_t max_touches; /* limit */
    uint32_t touches;     /* counted so far */
    uint8_t by_object;    /* 1: the model's thresholds by object come before `odds` */
    uint8_t verdict;      /* a palpate_verdict */
    uint8_t object;       /* the one that was recognized */
#if PALPATE_ROW_EVIDENCE
    uint32_t unit_, from_, span_; /* bits in a unit of evidence of this number of touches, and of this many numbers */
#endif
    int64_t evidence[PALPATE_MAX_OBJECTS];
} palpate_recognizer;

/* True if several outputs may belong to one object. */
#if PALPATE_OUTPUTS
#define PALPATE_HAS_OUTPUTS_(model) ((model)->outputs_ != NULL)
#else
#define PALPATE_HAS_OUTPUTS_(model) 0
#endif
/* No object. */
#define PALPATE_NONE_ PALPATE_AS_(uint_fast16_t, 0xffff)

/* Parts of a model. */
enum { PALPATE_TEXT_, PALPATE_OPTIONAL_, PALPATE_MARGINS_, PALPATE_AXES_, PALPATE_GROUPS_, PALPATE_SPLITS_, PALPATE_LEAVES_, PALPATE_END_ };

/* True if a model has this layout, or type of leaf: a constant where only one is built in. */
#define PALPATE_IS_LAYOUT_(model, bit, code) \
    (PALPATE_LAYOUTS == (bit) || ((PALPATE_LAYOUTS & (bit)) != 0 && (model)->layout_ == (code)))
#define PALPATE_IS_LEAF_(model, bit, code) \
    (PALPATE_LEAVES == (bit) || ((PALPATE_LEAVES & (bit)) != 0 && (model)->leaf_ == (code)))
#define PALPATE_IS_WIDE_(model) PALPATE_IS_LAYOUT_(model, PALPATE_WIDE, 1)
#define PALPATE_IS_CODE_(model) PALPATE_IS_LAYOUT_(model, PALPATE_CODE, 2)
/* True if leaves are indices into a table. */
#define PALPATE_IS_SHARED_(model) (PALPATE_SHARED && (PALPATE_LAYOUTS & 3) != 0 && (model)->table_ != NULL)
#define PALPATE_IS_I8_(model) PALPATE_IS_LEAF_(model, PALPATE_I8, 0)
#define PALPATE_IS_I16_(model) PALPATE_IS_LEAF_(model, PALPATE_I16, 1)
#define PALPATE_IS_F32_(model) PALPATE_IS_LEAF_(model, PALPATE_F32, 2)

/* ---- Lengths ---- */

/* Bytes between two places. */
static inline uint32_t palpate_between_(const uint8_t *start, const uint8_t *end)
{
    /* Cast to a size first: with pointers of 16 bits, a difference above 32,767 is negative. */
    const size_t length = PALPATE_AS_(size_t, end - start);
    return PALPATE_AS_(uint32_t, length);
}

/* True if `rest` bytes hold `head` bytes, and after them `count` pieces of `size` bytes. Every length that a model states is
 * compared with what is left here, and nowhere else is one subtracted. Numbers whose product may not fit 32 bits are more than any
 * model has: 2^18 pieces, or 2^14 bytes. */
PALPATE_NEAR_ int palpate_holds_(uint32_t rest, uint32_t head, uint32_t count, uint32_t size)
{
    return head <= rest && (count >> 18 | size >> 14) == 0 && count * size <= rest - head;
}

/* ---- Bytes ---- */

static inline uint32_t palpate_u16_(const uint8_t *p)
{
    return PALPATE_AS_(uint32_t, PALPATE_BYTE(p)) | PALPATE_AS_(uint32_t, PALPATE_BYTE(p + 1)) << 8;
}

PALPATE_U32_ uint32_t palpate_u32_(const uint8_t *p)
{
    return PALPATE_AS_(uint32_t, PALPATE_BYTE(p)) | PALPATE_AS_(uint32_t, PALPATE_BYTE(p + 1)) << 8 |
           PALPATE_AS_(uint32_t, PALPATE_BYTE(p + 2)) << 16 | PALPATE_AS_(uint32_t, PALPATE_BYTE(p + 3)) << 24;
}

PALPATE_NEAR_ int32_t palpate_i32_(const uint8_t *p)
{
    const uint32_t number = palpate_u32_(p);
    return PALPATE_AS_(int32_t, number);
}

/* The CRC-32 so far with one more byte; it begins with all ones, and ends inverted. */
PALPATE_APART_ uint32_t palpate_crc_(uint32_t sum, uint8_t byte)
{
    uint_fast8_t i;
    sum ^= byte;
    for (i = 0; i < 8; i++) {
        sum = sum >> 1 ^ (0xedb88320u & (0u - (sum & 1)));
    }
    return sum;
}

/* A signed number of 1 to 4 bytes. */
static inline int32_t palpate_signed_(const uint8_t *p, uint_fast8_t width)
{
    uint32_t number;
    if (width == 2) {
        return PALPATE_AS_(int16_t, PALPATE_AS_(uint16_t, palpate_u16_(p)));
    }
    if (width == 4) {
        return palpate_i32_(p);
    }
    p += width;
    number = 0u - PALPATE_AS_(uint32_t, PALPATE_BYTE(p - 1) >> 7);
    do {
        p--;
        number = number << 8 | PALPATE_BYTE(p);
    } while (--width != 0);
    return PALPATE_AS_(int32_t, number);
}

/* ---- Opening a model: after it nothing can fail ---- */

/* The number of a shared leaf at `leaf`. */
static inline uint32_t palpate_number_(const palpate_model *model, const uint8_t *leaf)
{
    return PALPATE_BYTE(model->table_ - 4) == 1 ? PALPATE_BYTE(leaf) : palpate_u16_(leaf);
}

static inline size_t palpate_leaf_size_(const palpate_model *model)
{
    return PALPATE_IS_I8_(model) ? 1 : PALPATE_IS_I16_(model) ? 2 : 4;
}

static inline palpate_error palpate_wrong_(palpate_model *model, palpate_error error, const uint8_t *place)
{
    model->wrong = palpate_between_(model->bytes, place);
    return error;
}

/* Zeros after the content of an optional section. */
static inline uint32_t palpate_zeros_(uint32_t length)
{
    return (0u - length) & 3;
}

/* True if an optional section starts at `head`, and is whole before `end`. */
static inline int palpate_is_section_(const uint8_t *head, const uint8_t *end)
{
    uint32_t length;
    if (!palpate_holds_(palpate_between_(head, end), 8, 0, 0)) {
        return 0;
    }
    length = palpate_u32_(head + 4);
    return palpate_holds_(palpate_between_(head + 8, end), length, palpate_zeros_(length), 1);
}

/* The optional section at `p`, which is whole: its tag as it stands there. Its content starts 8 bytes after `p`, and has `length`
 * bytes; `p` becomes where the next one starts. */
static inline uint32_t palpate_section_(const uint8_t **p, uint32_t *length)
{
    const uint8_t *head = *p;
    *length = palpate_u32_(head + 4);
    *p = head + 8 + *length + palpate_zeros_(*length);
    return palpate_u16_(head);
}

/* The trained touches in a section; 0 if they make no sense. */
static inline int palpate_trained_(palpate_model *model, const uint8_t *content)
{
    uint8_t patterns = PALPATE_BYTE(content), counted = PALPATE_BYTE(content + 1), pose = PALPATE_BYTE(content + 2);
    uint8_t possible = counted == 0 ? 0x20 : counted == 1 ? 0x3e : 0x3f;
    if (counted > 2 || pose > 1 || patterns == 0 || (patterns & ~possible) != 0) {
        return 0;
    }
    model->patterns = patterns;
    model->needs_pose = pose;
    model->largest_spread = palpate_u32_(content + 4);
    return 1;
}

/* Bytes of an object's record in a misfit test with this many rivals. */
static inline uint32_t palpate_record_(uint32_t rivals)
{
    return (8 + rivals + (rivals & 1) + 4 * rivals + rivals * (rivals + 1) + 3) & ~PALPATE_AS_(uint32_t, 3);
}

/* A background, and a misfit test; 0 if they make no sense. */
static inline int palpate_check_strangers_(palpate_model *model, const uint8_t *content, uint32_t length)
{
    const uint8_t *record = content + 36;
    uint32_t rivals, size;
    uint_fast16_t object;
    if (!palpate_holds_(length, 4, 0, 0) || PALPATE_BYTE(content) > 1 || PALPATE_BYTE(content + 1) > 1 ||
        model->objects == PALPATE_BYTE(content)) {
        return 0;
    }
    model->strangers_ = content;
    model->known = PALPATE_AS_(uint16_t, model->objects - PALPATE_BYTE(content));
    if (PALPATE_BYTE(content + 1) == 0) {
        return 1;
    }
    if (!palpate_holds_(length, 36, 0, 0)) {
        return 0;
    }
    rivals = PALPATE_BYTE(content + 4);
    size = palpate_record_(rivals);
    if (rivals - 1 > 15 || palpate_u32_(content + 8) == 0 || palpate_u32_(content + 16) >> 31 != 0 ||
        !palpate_holds_(length, 36, model->known, size)) {
        return 0;
    }
    for (object = 0; object < model->known; object++) {
        uint_fast8_t i;
        for (i = 0; i < 8 + rivals; i++) {
            const uint8_t byte = PALPATE_BYTE(record + i);
            if (i < 3 ? byte > 40 : i >= 8 && byte >= model->objects) {
                return 0;
            }
        }
        record += size;
    }
    return 1;
}

/* Evidence of a row by its margins; 0 if it makes no sense. */
static inline int palpate_check_row_(palpate_model *model, const uint8_t *content, uint32_t length)
{
    uint32_t start, i;
    uint8_t dropped, between, scale, last;
    if (!palpate_holds_(length, 8, 0, 0)) {
        return 0;
    }
    start = palpate_u32_(content);
    start = start >> 31 != 0 ? 0u - start : start;
    dropped = PALPATE_BYTE(content + 4);
    between = PALPATE_BYTE(content + 5);
    scale = PALPATE_BYTE(content + 6);
    last = PALPATE_BYTE(content + 7);
    if (last == 0 || last > 128 || !palpate_holds_(length, 9, last, 1) || start > 0x40000000u || between > 15 ||
        dropped + between > 26 || between + scale > 22 || model->descriptor != 255) {
        return 0;
    }
    for (i = 8; i < 8u + last; i++) {
        if (PALPATE_BYTE(content + i) > PALPATE_BYTE(content + i + 1)) {
            return 0;
        }
    }
    model->row_ = content;
    model->row_start_ = palpate_i32_(content);
    model->row_most_ = (PALPATE_AS_(uint32_t, last) << between) - 1;
    return 1;
}

#if PALPATE_OUTPUTS
/* Outputs of objects that are numbered in their order, and the most of one. */
static inline int palpate_check_outputs_(const palpate_model *model, const uint8_t *content, uint32_t length)
{
    uint_fast16_t most = 0, count = 0, before = 0, i;
    if (!palpate_holds_(length, 4, model->objects, 4)) {
        return 0;
    }
    for (i = 0; i < model->objects; i++) {
        const uint_fast16_t object = PALPATE_BYTE(content + 4 + 4 * PALPATE_AS_(size_t, i));
        if (object != before && (count == 0 || object != before + 1u)) {
            return 0;
        }
        count = object == before ? count + 1u : 1u;
        before = object;
        most = count > most ? count : most;
    }
    return most == PALPATE_BYTE(content) + 1u;
}
#endif

/* Sections that are whole, in order, valid, and understood where they must be. */
static inline palpate_error palpate_check_sections_(palpate_model *model)
{
    const uint8_t *p = model->part_[PALPATE_OPTIONAL_], *end = model->part_[PALPATE_MARGINS_];
    uint32_t last = 0;
    while (p != end) {
        const uint8_t *content = p + 8;
        /* Least content: numbers of bytes and pieces. */
        uint32_t length, tag, least = 0, pieces = 0, piece = 0;
        palpate_wrong_(model, PALPATE_OK, p);
        if (!palpate_is_section_(p, end)) {
            return PALPATE_SECTION;
        }
        tag = palpate_section_(&p, &length);
        if ((tag & 0x7fff) <= last) {
            return PALPATE_FIELD;
        }
        last = tag & 0x7fff;
        switch (last) {
        case 1: /* probe */
        case 3: /* noise */
            least = 16;
            break;
        case 2:
            if (!palpate_holds_(length, 8, 0, 0) || !palpate_trained_(model, content)) {
                return PALPATE_FIELD;
            }
            break;
        case 5:
            model->odds_ = content;
            pieces = model->objects;
            piece = 4;
            break;
        case 7: /* plan: pairs of objects, 26 directions with 1, 2 or 4 rolls */
            least = 4;
            pieces = PALPATE_AS_(uint32_t, model->objects) * (model->objects - 1u) / 2;
            if (!palpate_holds_(length, least, 0, 0) || pieces == 0 || PALPATE_BYTE(content) != 0) {
                return PALPATE_FIELD;
            }
            piece = PALPATE_BYTE(content + 1);
            if (piece != 1 && piece != 2 && piece != 4) {
                return PALPATE_FIELD;
            }
            piece *= 26;
            break;
        default:
            if (PALPATE_STRANGERS && last == 6) {
                if (!palpate_check_strangers_(model, content, length)) {
                    return PALPATE_FIELD;
                }
            } else if (PALPATE_SHARED && (PALPATE_LAYOUTS & 3) != 0 && last == 12) {
                if (!palpate_holds_(length, 4, 0, 0) || PALPATE_BYTE(content) - 1u > 1) {
                    return PALPATE_FIELD;
                }
                model->table_ = content + 4;
            } else if (last == 13) {
                /* The prediction: a link, a rule for ties, a scale that is positive and finite; a divisor that is not 0; such a
                 * scale and a finite offset for each output. */
                if (!palpate_holds_(length, 8, 0, 0) || (PALPATE_BYTE(content) & 63) > 4 || PALPATE_BYTE(content + 1) > 1 ||
                    palpate_u32_(content + 4) - 1 >= 0x7f7fffffu) {
                    return PALPATE_FIELD;
                }
                if (PALPATE_BYTE(content) > 127 && (!palpate_holds_(length, 12, 0, 0) || palpate_u32_(content + 8) == 0)) {
                    return PALPATE_FIELD;
                }
                if ((PALPATE_BYTE(content) & 64) != 0) {
                    uint32_t own = PALPATE_BYTE(content) > 127 ? 12 : 8;
                    uint_fast16_t output;
                    if (!palpate_holds_(length, own, model->objects, 8)) {
                        return PALPATE_FIELD;
                    }
                    for (output = 0; output < model->objects; output++, own += 8) {
                        if (palpate_u32_(content + own) - 1 >= 0x7f7fffffu ||
                            (palpate_u32_(content + own + 4) & 0x7fffffffu) >= 0x7f800000u) {
                            return PALPATE_FIELD;
                        }
                    }
                }
            } else if (PALPATE_SENTINEL && last == 14) {
                if (!palpate_holds_(length, 8, 0, 0) || palpate_i32_(content) > palpate_i32_(content + 4)) {
                    return PALPATE_FIELD;
                }
                model->sentinel_ = content;
            } else if (PALPATE_ROW_EVIDENCE && last == 4) {
                /* Weights by the number of touches or rows. */
                least = 2;
                if (!palpate_holds_(length, least, 0, 0) || PALPATE_BYTE(content) - 1u > 63) {
                    return PALPATE_FIELD;
                }
                model->weights_ = content;
                pieces = PALPATE_BYTE(content);
                piece = 2;
            } else if (PALPATE_ROW_EVIDENCE && last == 16) {
                if (!palpate_check_row_(model, content, length)) {
                    return PALPATE_FIELD;
                }
#if PALPATE_SEQUENCES
            } else if (last == 21) {
                /* A feature that exists, and a step above 0, in a model over rows. */
                if (!palpate_holds_(length, 8, 0, 0) || PALPATE_BYTE(content) >= model->features || palpate_i32_(content + 4) < 1 ||
                    model->descriptor != 255) {
                    return PALPATE_FIELD;
                }
                model->position_ = content;
            } else if (last == 22) {
                if (model->descriptor != 255) {
                    return PALPATE_FIELD;
                }
                model->guard_ = content;
                pieces = model->features;
                piece = 12;
#endif
#if PALPATE_OUTPUTS
            } else if (last == 18) {
                if (!palpate_check_outputs_(model, content, length)) {
                    return PALPATE_FIELD;
                }
                model->outputs_ = content;
#endif
            } else if (tag != last) {
                return PALPATE_NOT_UNDERSTOOD;
            }
        }
        if (!palpate_holds_(length, least, pieces, piece)) {
            return PALPATE_FIELD;
        }
    }
    return PALPATE_OK;
}

/* Axes of features that exist, columns that a byte numbers, thresholds that ascend and fill their section. */
static inline palpate_error palpate_check_axes_(palpate_model *model)
{
    const uint8_t *axis = model->part_[PALPATE_AXES_], *end = model->part_[PALPATE_GROUPS_];
    const uint8_t *cuts = model->cuts_;
    uint_fast16_t columns = 0;
    for (; axis != model->cuts_; axis += 4) {
        uint8_t kind = PALPATE_BYTE(axis + 1), width = PALPATE_BYTE(axis + 2), count = PALPATE_BYTE(axis + 3);
        int32_t last = INT32_MIN;
        columns += 1u + (kind == 3);
        if (kind - 1u > 2 || width - 1u > 3 || PALPATE_BYTE(axis) >= model->features || columns > 256) {
            return palpate_wrong_(model, PALPATE_FIELD, axis);
        }
        if (!palpate_holds_(palpate_between_(cuts, end), 0, count, width)) {
            return palpate_wrong_(model, PALPATE_SECTION, cuts);
        }
        for (; count != 0; count--) {
            const int32_t next = palpate_signed_(cuts, width);
            if (next < last) {
                return palpate_wrong_(model, PALPATE_FIELD, axis);
            }
            last = next;
            cuts += width;
        }
    }
    if (PALPATE_IS_WIDE_(model) ? axis != model->part_[PALPATE_AXES_] || (palpate_between_(cuts, end) & 3) != 0 : cuts != end) {
        return palpate_wrong_(model, PALPATE_SECTION, cuts);
    }
    if (PALPATE_IS_CODE_(model) && model->part_[PALPATE_AXES_] != end) {
        return palpate_wrong_(model, PALPATE_SECTION, model->part_[PALPATE_AXES_]);
    }
    return PALPATE_OK;
}

/* Groups whose splits and leaves fill their parts exactly, and whose margins stay within 2^30. */
static inline palpate_error palpate_check_groups_(palpate_model *model)
{
    const uint32_t limit = PALPATE_AS_(uint32_t, 1) << 30;
    const uint8_t *group = model->part_[PALPATE_GROUPS_], *splits = model->part_[PALPATE_SPLITS_];
    const uint8_t *leaves = model->part_[PALPATE_LEAVES_], *end = model->part_[PALPATE_END_];
    const uint8_t bits = PALPATE_IS_I8_(model) ? 7 : 15;
    uint32_t range = PALPATE_AS_(uint32_t, 1) << 20, most = 0;
    uint_fast16_t object;
    uint_fast8_t shift = 24;
    if (PALPATE_IS_CODE_(model) && group != splits) {
        return palpate_wrong_(model, PALPATE_SECTION, group);
    }
    for (; group != model->part_[PALPATE_SPLITS_]; group += 8) {
        uint32_t trees = palpate_u32_(group + 4), leaf = PALPATE_AS_(uint32_t, palpate_leaf_size_(model)), length, table = 0;
        const uint8_t *number = leaves;
        uint8_t one = PALPATE_BYTE(group + 2);
        int fits = 1;
        if (PALPATE_BYTE(group + 1) > shift || one > 1 || (one != 0 && PALPATE_BYTE(group + 3) >= model->objects) ||
            (PALPATE_IS_F32_(model) && PALPATE_BYTE(group + 1) != 0)) {
            return palpate_wrong_(model, PALPATE_FIELD, group);
        }
        shift = PALPATE_BYTE(group + 1);
        if (!PALPATE_IS_F32_(model)) {
            if (trees > limit >> bits >> shift) {
                return palpate_wrong_(model, PALPATE_MARGIN_RANGE, model->bytes + 8);
            }
            /* By 32 bits or more only where there is no tree. */
            range += trees << ((bits + shift) & 31);
            range = range > limit ? limit + 1 : range;
        }
        if (one == 0) {
            leaf *= model->objects;
        }
        length = leaf;
        if (PALPATE_IS_SHARED_(model)) {
            leaf = PALPATE_BYTE(model->table_ - 4);
            table = palpate_u32_(model->table_ - 8);
        }
        for (; trees != 0 && fits; trees--) {
            /* A number of splits, and the splits. */
            const uint32_t rest = palpate_between_(splits, model->part_[PALPATE_LEAVES_]), node = PALPATE_IS_WIDE_(model) ? 6 : 3;
            const uint32_t nodes = palpate_holds_(rest, 2, 0, 0) ? palpate_u16_(splits) : 0;
            fits = palpate_holds_(rest, 2, nodes, node) && palpate_holds_(palpate_between_(leaves, end), 0, nodes + 1, leaf);
            if (fits) {
                splits += PALPATE_AS_(size_t, 2 + nodes * node);
                leaves += PALPATE_AS_(size_t, (nodes + 1) * leaf);
            }
        }
        if (!fits) {
            return palpate_wrong_(model, PALPATE_SECTION, model->part_[PALPATE_SPLITS_]);
        }
        for (; PALPATE_IS_SHARED_(model) && number != leaves; number += leaf) {
            if (!palpate_holds_(table, 4, palpate_number_(model, number) + 1, length)) {
                return palpate_wrong_(model, PALPATE_FIELD, number);
            }
        }
    }
    if (splits != model->part_[PALPATE_LEAVES_]) {
        return palpate_wrong_(model, PALPATE_SECTION, splits);
    }
    if (leaves != end) {
        return palpate_wrong_(model, PALPATE_SECTION, leaves);
    }
    for (object = 0; !PALPATE_IS_F32_(model) && object < model->objects; object++) {
        uint32_t base = palpate_u32_(model->part_[PALPATE_MARGINS_] + 4 * PALPATE_AS_(size_t, object));
        base = base >> 31 != 0 ? 0u - base : base;
        most = base > most ? base : most;
    }
    return range + most > limit ? palpate_wrong_(model, PALPATE_MARGIN_RANGE, model->bytes + 8) : PALPATE_OK;
}

/* The place of a number of the header that makes no sense; 0 if there is none. */
static inline uint8_t palpate_wrong_number_(const uint8_t *bytes)
{
    uint32_t unit = palpate_u32_(bytes + 32), shift, difference;
    uint64_t bits = PALPATE_AS_(uint64_t, (unit & 0x7fffff) | 0x800000) * 3098164010u; /* log2 e in Q31 */
    if (unit < 0x33800000u || unit > 0x3f000000u) { /* 2^-24 to 0.5 */
        return 32;
    }
    shift = 149u - (unit >> 23) - PALPATE_BYTE(bytes + 40);
    if (shift > 63) {
        return 40;
    }
    bits = (bits >> shift) + 2 - palpate_u32_(bytes + 36);
    difference = PALPATE_AS_(uint32_t, bits >> 32);
    if (difference != 0 || PALPATE_AS_(uint32_t, bits) > 4) {
        return 36;
    }
    return PALPATE_BYTE(bytes + 55) != 0 ? 48 : palpate_u32_(bytes + 56) == 0 ? 56 : 0;
}

/* The place of a code of the header that is not known, or of a number that makes no sense; 0 if there is none. */
static inline uint8_t palpate_wrong_header_(palpate_model *model)
{
    const uint8_t *bytes = model->bytes;
    if (model->layout_ > 2) {
        return 6;
    }
    if (model->leaf_ > 2) {
        return 7;
    }
    if (model->descriptor != 255) {
        if (model->descriptor > 6) {
            return 12;
        }
        /* 3, 2, 4, 8, 4, 6 and 10 features. */
        if (model->features != (0xa648423u >> 4 * model->descriptor & 15)) {
            return 15;
        }
        if (model->real != 0) {
            return 13;
        }
    }
    return model->real > 1 ? 13 : palpate_wrong_number_(bytes);
}

/* Opens a model of any layout; of the layout code without its trees. */
static inline palpate_error palpate_open_(palpate_model *model, const uint8_t *bytes, size_t length)
{
    uint32_t lengths[7], rest, i;
    const uint8_t *p, *end;
    palpate_error error;
    model->bytes = bytes;
    for (i = 0; i < 4 && i < length; i++) {
        if (PALPATE_BYTE(bytes + i) != PALPATE_AS_(uint8_t, 0x54504c50u >> 8 * i)) { /* PLPT */
            return palpate_wrong_(model, PALPATE_NOT_A_MODEL, bytes);
        }
    }
    if (length < 96) {
        return palpate_wrong_(model, PALPATE_LENGTH, bytes + length);
    }
    if (palpate_u16_(bytes + 4) != 3) {
        return palpate_wrong_(model, PALPATE_VERSION, bytes + 4);
    }
    rest = palpate_u32_(bytes + 8);
    if (length != rest) {
        return palpate_wrong_(model, PALPATE_LENGTH, bytes + (length < rest ? length : PALPATE_AS_(size_t, rest)));
    }
    rest = 0xffffffffu;
    end = bytes + length;
    /* A compiler that knows the symbol at a model's end takes a pointer before it for one outside of an array. */
    for (p = bytes; p + 4 != end; p++) {
        rest = palpate_crc_(rest, PALPATE_BYTE(p));
    }
    if (~rest != palpate_u32_(p)) {
        return palpate_wrong_(model, PALPATE_CHECKSUM, bytes + 8);
    }
    model->layout_ = PALPATE_BYTE(bytes + 6);
    model->leaf_ = PALPATE_BYTE(bytes + 7);
    model->descriptor = PALPATE_BYTE(bytes + 12);
    model->real = PALPATE_BYTE(bytes + 13);
    model->objects = PALPATE_AS_(uint16_t, PALPATE_BYTE(bytes + 14) + 1);
    model->features = PALPATE_AS_(uint16_t, PALPATE_BYTE(bytes + 15) + 1);
    /* The parts follow each other. */
    lengths[PALPATE_TEXT_] = palpate_u32_(bytes + 68);
    lengths[PALPATE_OPTIONAL_] = palpate_u32_(bytes + 92);
    lengths[PALPATE_MARGINS_] = 8 * PALPATE_AS_(uint32_t, model->objects);
    i = 4 * palpate_u16_(bytes + 16);
    rest = palpate_u32_(bytes + 80);
    lengths[PALPATE_AXES_] = rest + i < i ? UINT32_MAX : rest + i;
    lengths[PALPATE_GROUPS_] = 8 * palpate_u16_(bytes + 18);
    lengths[PALPATE_SPLITS_] = palpate_u32_(bytes + 84);
    lengths[PALPATE_LEAVES_] = palpate_u32_(bytes + 88);
    p = bytes + 96;
    for (i = 0; i < 7; i++) {
        model->part_[i] = p;
        if (!palpate_holds_(palpate_between_(p, end), lengths[i], 0, 0)) {
            return palpate_wrong_(model, PALPATE_SECTION, p);
        }
        p += lengths[i];
    }
    model->part_[PALPATE_END_] = p;
    if (palpate_between_(p, end) != 4) {
        return palpate_wrong_(model, PALPATE_SECTION, p);
    }
    model->cuts_ = model->part_[PALPATE_AXES_] + 4 * PALPATE_AS_(size_t, palpate_u16_(bytes + 16));
    model->wrong = palpate_wrong_header_(model);
    if (model->wrong != 0) {
        return PALPATE_FIELD;
    }
    if ((PALPATE_LAYOUTS & PALPATE_CODE) != 0 && model->layout_ == 2 && model->leaf_ == 2) {
        return palpate_wrong_(model, PALPATE_FIELD, bytes + 7);
    }
    if ((PALPATE_LAYOUTS >> model->layout_ & 1) == 0) {
        return palpate_wrong_(model, PALPATE_NOT_BUILT_IN, bytes + 6);
    }
    if ((PALPATE_LEAVES >> model->leaf_ & 1) == 0) {
        return palpate_wrong_(model, PALPATE_NOT_BUILT_IN, bytes + 7);
    }
    model->odds_ = NULL;
    model->strangers_ = NULL;
    if (PALPATE_SHARED) {
        model->table_ = NULL;
    }
    if (PALPATE_SENTINEL) {
        model->sentinel_ = NULL;
    }
    if (PALPATE_ROW_EVIDENCE) {
        model->weights_ = NULL;
        model->row_ = NULL;
    }
#if PALPATE_SEQUENCES
    model->position_ = NULL;
    model->guard_ = NULL;
#endif
#if PALPATE_OUTPUTS
    model->outputs_ = NULL;
#endif
    model->known = model->objects;
    model->patterns = 0x20;
    model->largest_spread = UINT32_MAX;
    model->needs_pose = PALPATE_AS_(uint8_t, model->descriptor < 7 && (0x6cu >> model->descriptor & 1) != 0);
    error = palpate_check_sections_(model);
    if (error == PALPATE_OK) {
        error = palpate_check_axes_(model);
    }
    if (error == PALPATE_OK) {
        error = palpate_check_groups_(model);
    }
    return error;
}

/* Opens a model, checking everything that is relied on later. `bytes` must stay as they are while it is used. On an error
 * `model->wrong` is its place, and the model must not be used. Cost: in proportion to the bytes, for the checksum. */
PALPATE_API palpate_error palpate_open(palpate_model *model, const uint8_t *bytes, size_t length)
{
    const palpate_error error = palpate_open_(model, bytes, length);
    if ((PALPATE_LAYOUTS & PALPATE_CODE) != 0 && error == PALPATE_OK && PALPATE_IS_CODE_(model)) {
        return palpate_wrong_(model, PALPATE_NEEDS_CODE, bytes + 6);
    }
    return error;
}

#if PALPATE_LAYOUTS & PALPATE_CODE
/* Opens a model of the layout code in the same way, with the function that `palpate export` wrote with it: from a row of all
 * features, as palpate_margins_of has them, to margins. */
PALPATE_API palpate_error palpate_open_code(palpate_model *model, const uint8_t *bytes, size_t length,
                                            void (*code)(const int32_t *features, int32_t *margins))
{
    const palpate_error error = palpate_open_(model, bytes, length);
    if (error == PALPATE_OK && model->layout_ != 2) {
        return palpate_wrong_(model, PALPATE_FIELD, bytes + 6);
    }
    model->code = code;
    return error;
}
#endif

/* An object's name, with 0 at its end, cut to `room` bytes together: its bytes in the model, meant as UTF-8. Empty for one
 * that the model does not know. Returns its length. */
PALPATE_API size_t palpate_object_name(const palpate_model *model, uint16_t object, char *name, size_t room)
{
    const uint8_t *text = model->part_[PALPATE_TEXT_], *end = model->part_[PALPATE_OPTIONAL_];
    size_t length = 0, i;
    uint32_t skipped;
    for (skipped = 0; text != end; skipped++) {
        length = PALPATE_BYTE(text);
        text++;
        if (!palpate_holds_(palpate_between_(text, end), 0, PALPATE_AS_(uint32_t, length), 1)) {
            length = 0;
            break;
        }
        if (skipped == PALPATE_AS_(uint32_t, object) + 1) {
            break;
        }
        text += length;
        length = 0;
    }
    if (room != 0) {
        length = length < room ? length : room - 1;
        for (i = 0; i < length; i++) {
            name[i] = PALPATE_AS_(char, PALPATE_BYTE(text + i));
        }
        name[length] = 0;
    }
    return length;
}

/* ---- Features ---- */

/* The key of an f32 value with these bits, as rows of a model whose `real` is 1 hold them. NaN is missing. */
PALPATE_API int32_t palpate_key(uint32_t bits)
{
    uint32_t magnitude = bits & 0x7fffffffu;
    if (magnitude > 0x7f800000u) {
        return PALPATE_MISSING_FEATURE;
    }
    return bits >> 31 != 0 ? -PALPATE_AS_(int32_t, magnitude) : PALPATE_AS_(int32_t, magnitude);
}

/* The key of an f32 value. Cost: a few instructions, none of them in floating point. */
PALPATE_API int32_t palpate_f32_key(float value)
{
    union {
        float value;
        uint32_t bits;
    } both;
    both.value = value;
    return palpate_key(both.bits);
}

static inline int32_t palpate_clamp_(int32_t value)
{
    const int32_t limit = (PALPATE_AS_(int32_t, 1) << 24) - 1;
    return value > limit ? limit : value < -limit && value != PALPATE_MISSING_FEATURE ? -limit : value;
}

/* Times from the earliest on. */
static inline void palpate_times_(const palpate_touch *touch, uint32_t *times)
{
    uint32_t earliest = PALPATE_MISSING;
    uint_fast8_t i;
    for (i = 0; i < 3; i++) {
        times[i] = touch->times[i];
        earliest = times[i] < earliest ? times[i] : earliest;
    }
    for (i = 0; i < 3; i++) {
        times[i] -= times[i] == PALPATE_MISSING ? 0 : earliest;
    }
}

/* The code of a touch's contacts: 0 none, 1 one outer finger, 2 the middle one, 3 middle and outer, 4 both outer, 5 all. */
static inline uint8_t palpate_pattern_(const uint32_t *times)
{
    uint8_t code = PALPATE_AS_(uint8_t, (times[0] != PALPATE_MISSING) + (times[2] != PALPATE_MISSING));
    code = PALPATE_AS_(uint8_t, 2 * code + (times[1] != PALPATE_MISSING));
    return code - 1u < 2 ? PALPATE_AS_(uint8_t, 3 - code) : code;
}

/* Reason why a model over touches does not count one, or PALPATE_COUNTED. */
static inline palpate_answer palpate_accepts_(const palpate_model *model, const palpate_touch *touch, const uint32_t *times)
{
    uint_fast8_t i;
    if (model->descriptor == 255) {
        return PALPATE_NEEDS_FEATURES;
    }
    if ((model->patterns >> palpate_pattern_(times) & 1) == 0) {
        return PALPATE_REFUSED_PATTERN;
    }
    for (i = 0; i < 3; i++) {
        if (times[i] != PALPATE_MISSING && times[i] > model->largest_spread) {
            return PALPATE_REFUSED_SPREAD;
        }
    }
    return model->needs_pose != 0 && touch->has_pose == 0 ? PALPATE_REFUSED_NO_POSE : PALPATE_COUNTED;
}

/* The `model->features` features of a touch, for a model over touches. */
static inline void palpate_features_(const palpate_model *model, const palpate_touch *touch, const uint32_t *times, int32_t *features)
{
    const int32_t none = PALPATE_MISSING_FEATURE;
    const uint8_t descriptor = model->descriptor;
    int32_t at[3], curvature = none, slope = none, pair = none;
    uint_fast8_t i;
    for (i = 0; i < 3; i++) {
        const uint32_t limit = PALPATE_AS_(uint32_t, 1) << 28;
        at[i] = times[i] == PALPATE_MISSING ? none : PALPATE_AS_(int32_t, times[i] < limit ? times[i] : limit);
    }
    if (descriptor == 0) {
        for (i = 0; i < 3; i++) {
            features[i] = palpate_clamp_(at[i]);
        }
        return;
    }
    if (at[0] != none && at[2] != none) {
        slope = at[0] < at[2] ? at[2] - at[0] : at[0] - at[2];
        if (at[1] != none) {
            curvature = at[0] - 2 * at[1] + at[2];
        }
    } else if (at[1] != none) {
        /* The outer finger that touched, if one did: missing is the least number. */
        pair = at[0] > at[2] ? at[0] : at[2];
        pair = pair == none ? none : at[1] - pair;
    }
    if (descriptor >= 4) {
        *features++ = palpate_pattern_(times);
    }
    *features++ = palpate_clamp_(curvature);
    *features++ = palpate_clamp_(slope);
    if (descriptor >= 4) {
        *features++ = palpate_clamp_(pair);
    }
    /* The known part of the pose, from x or from z on. */
    if ((0x6cu >> descriptor & 1) != 0) {
        const uint8_t first = (0x24u >> descriptor & 1) != 0 ? 2 : 0;
        int flip = 0;
        if (at[0] != at[2]) {
            /* A missing contact is later than any other: the largest as a number without a sign. */
            flip = PALPATE_AS_(uint32_t, at[0]) > PALPATE_AS_(uint32_t, at[2]);
        } else {
            /* The first component that is not 0 decides; the last one with partial touches. */
            for (i = 0; i < 3; i++) {
                int16_t part = touch->alignment[descriptor >= 4 ? i : 2 - i];
                flip = part == 0 ? flip : part < 0;
            }
        }
        for (i = first; i < 3; i++) {
            *features++ = touch->has_pose == 0 ? none : touch->direction[i];
        }
        for (i = first; i < 3; i++) {
            int32_t part = touch->alignment[i];
            part = !flip ? part : part == -32768 ? 32767 : -part;
            *features++ = touch->has_pose == 0 ? none : part;
        }
    }
}

/* ---- Margins ---- */

/* Number of an axis's `count` thresholds of `width` bytes that are at or below `value`. */
PALPATE_APART_ uint8_t palpate_rank_(const uint8_t *cuts, uint_fast8_t width, uint_fast8_t count, int32_t value)
{
    uint_fast16_t rank = 0, step = count < 16 ? 8 : 128;
    /* Not before the model: its header is. */
    cuts -= width;
    while (step > count) {
        step >>= 1;
    }
    for (; step != 0; step >>= 1) {
        const uint_fast16_t next = rank + step;
        if (next <= count && palpate_signed_(cuts + PALPATE_AS_(size_t, width) * next, width) <= value) {
            rank = next;
        }
    }
    return PALPATE_AS_(uint8_t, rank);
}

/* A feature of a row of `count`. */
static inline int32_t palpate_value_(const palpate_model *model, const int32_t *features, uint16_t count, uint8_t feature)
{
    const int32_t value = feature < count ? features[feature] : PALPATE_MISSING_FEATURE;
    if (PALPATE_SENTINEL && model->sentinel_ != NULL && value >= palpate_i32_(model->sentinel_) &&
        value <= palpate_i32_(model->sentinel_ + 4)) {
        return PALPATE_MISSING_FEATURE;
    }
    return value;
}

/* Adds a leaf with `values` values to as many sums; bytes with 128 more than they are. */
PALPATE_APART_ void palpate_add_leaf_(const palpate_model *model, uint32_t *sums, uint16_t values, const uint8_t *leaf)
{
    uint32_t *const end = sums + values;
    if (PALPATE_IS_I8_(model)) {
        do {
            *sums++ += PALPATE_BYTE(leaf);
            leaf++;
        } while (sums != end);
    } else if (PALPATE_IS_I16_(model)) {
        do {
            /* Within 2^30, as was checked. */
            const int16_t value = PALPATE_AS_(int16_t, palpate_u16_(leaf));
            const int32_t sum = PALPATE_AS_(int32_t, *sums) + value;
            *sums++ = PALPATE_AS_(uint32_t, sum);
            leaf += 2;
        } while (sums != end);
    } else {
#if PALPATE_LEAVES & PALPATE_F32
        do {
            union {
                uint32_t bits;
                float value;
            } sum, more;
            sum.bits = *sums;
            more.bits = palpate_u32_(leaf);
            sum.value += more.value;
            *sums++ = sum.bits;
            leaf += 4;
        } while (sums != end);
#endif
    }
}

/* The number of the leaf that is reached in a compact tree of `below` splits. */
PALPATE_APART_ uint32_t palpate_walk_compact_(const uint8_t *ranks, const uint8_t *split, uint32_t below)
{
    uint32_t leaf = 0;
    while (below != 0) {
        uint32_t left = PALPATE_BYTE(split + 2);
        const int goes_right = ranks[PALPATE_BYTE(split)] > PALPATE_BYTE(split + 1);
        split += 3;
        below--;
        /* Sizes that contradict each other must not lead out of the tree. */
        left = left < below ? left : below;
        if (goes_right) {
            leaf += left + 1;
            split += PALPATE_AS_(size_t, left * 3);
            below -= left;
        } else {
            below = left;
        }
    }
    return leaf;
}

/* Walk through a wide tree, as above. */
PALPATE_APART_ uint32_t palpate_walk_wide_(const palpate_model *model, const int32_t *features, uint16_t count, const uint8_t *split,
                                           uint32_t below)
{
    const uint32_t cuts = palpate_between_(model->cuts_, model->part_[PALPATE_GROUPS_]) / 4;
    uint32_t leaf = 0;
    while (below != 0) {
        const int32_t value = palpate_value_(model, features, count, PALPATE_BYTE(split));
        const uint32_t number = palpate_u16_(split + 2);
        uint32_t left = palpate_u16_(split + 4);
        int goes_right = PALPATE_BYTE(split + 1) == 0;
        if (value != PALPATE_MISSING_FEATURE) {
            /* A threshold that does not exist is 0. */
            const uint32_t cut = number < cuts ? palpate_u32_(model->cuts_ + 4 * PALPATE_AS_(size_t, number)) : 0;
            goes_right = value >= PALPATE_AS_(int32_t, cut);
        }
        split += 6;
        below--;
        left = left < below ? left : below;
        if (goes_right) {
            leaf += left + 1;
            split += PALPATE_AS_(size_t, left * 6);
            below -= left;
        } else {
            below = left;
        }
    }
    return leaf;
}

/* Start of the `length` bytes of a leaf's values. */
static inline const uint8_t *palpate_values_(const palpate_model *model, const uint8_t *leaf, size_t length)
{
    return PALPATE_IS_SHARED_(model) ? model->table_ + palpate_number_(model, leaf) * length : leaf;
}

static inline void palpate_shift_(const palpate_model *model, uint32_t *sums, uint_fast8_t shift)
{
    uint_fast16_t i;
    for (i = 0; shift != 0 && i < model->objects; i++) {
        sums[i] <<= shift;
    }
}

#if PALPATE_LAYOUTS & PALPATE_CODE
/* The sums of a model whose trees are code. */
PALPATE_APART_ void palpate_call_(const palpate_model *model, const int32_t *features, uint16_t count, int32_t *sums)
{
    int32_t row[256];
    uint_fast16_t i;
    for (i = 0; i < model->features; i++) {
        row[i] = palpate_value_(model, features, count, PALPATE_AS_(uint8_t, i));
    }
    model->code(row, sums);
}
#endif

/* The sums of a row of features, in units or as the bits of f32 values. */
static inline void palpate_sum_(const palpate_model *model, const int32_t *features, uint16_t count, uint32_t *sums)
{
    const uint8_t *group = model->part_[PALPATE_GROUPS_], *splits = model->part_[PALPATE_SPLITS_];
    const uint8_t *leaves = model->part_[PALPATE_LEAVES_], *cuts = model->cuts_, *axis = model->part_[PALPATE_AXES_];
    const uint8_t *base = model->part_[PALPATE_MARGINS_];
    const size_t size = palpate_leaf_size_(model);
    uint32_t words[64];
    uint8_t *ranks = PALPATE_AT_(uint8_t *, words);
    uint_fast16_t i;
    uint_fast8_t last;
#if PALPATE_LAYOUTS & PALPATE_CODE
    if (PALPATE_IS_CODE_(model)) {
        palpate_call_(model, features, count, PALPATE_AT_(int32_t *, sums));
        return;
    }
#endif
    for (i = 0; i < model->objects; i++) {
        /* f32 values are added from the base on. */
        sums[i] = PALPATE_IS_F32_(model) ? palpate_u32_(base + 4 * PALPATE_AS_(size_t, i)) : 0;
    }
    /* Columns beyond the last have rank 0. */
    for (i = 0; i < 64; i += 4) {
        words[i] = 0;
        words[i + 1] = 0;
        words[i + 2] = 0;
        words[i + 3] = 0;
    }
    for (; axis != model->cuts_; axis += 4) {
        const uint8_t columns = PALPATE_BYTE(axis + 1), width = PALPATE_BYTE(axis + 2), most = PALPATE_BYTE(axis + 3);
        const int32_t value = palpate_value_(model, features, count, PALPATE_BYTE(axis));
        uint8_t left = 0, right = 255;
        if (value != PALPATE_MISSING_FEATURE) {
            left = palpate_rank_(cuts, width, most, value);
            right = left;
        }
        cuts += PALPATE_AS_(size_t, width) * most;
        if ((columns & 1) != 0) {
            *ranks++ = left;
        }
        if ((columns & 2) != 0) {
            *ranks++ = right;
        }
    }
    ranks = PALPATE_AT_(uint8_t *, words);
    last = group != splits ? PALPATE_BYTE(group + 1) : 0;
    for (; group != model->part_[PALPATE_SPLITS_]; group += 8) {
        const uint8_t shift = PALPATE_BYTE(group + 1);
        const int one = PALPATE_BYTE(group + 2) != 0;
        const uint16_t values = one ? 1 : model->objects;
        const size_t length = size * values;
        const size_t stored = PALPATE_IS_SHARED_(model) ? PALPATE_BYTE(model->table_ - 4) : length;
        uint32_t *first = one ? sums + PALPATE_BYTE(group + 3) : sums;
        uint32_t trees = palpate_u32_(group + 4);
        /* Shifts get smaller: what was added before is shifted on the way. */
        palpate_shift_(model, sums, PALPATE_AS_(uint_fast8_t, last - shift));
        last = shift;
        for (i = 0; PALPATE_IS_I8_(model) && i < values; i++) {
            first[i] -= trees << 7;
        }
        for (; trees != 0; trees--) {
            const uint32_t all = palpate_u16_(splits);
            uint32_t leaf;
            splits += 2;
            if (PALPATE_IS_WIDE_(model)) {
                leaf = palpate_walk_wide_(model, features, count, splits, all);
                splits += PALPATE_AS_(size_t, all * 6);
            } else {
                leaf = palpate_walk_compact_(ranks, splits, all);
                splits += PALPATE_AS_(size_t, all * 3);
            }
            palpate_add_leaf_(model, first, values, palpate_values_(model, leaves + PALPATE_AS_(size_t, leaf) * stored, length));
            leaves += PALPATE_AS_(size_t, all + 1) * stored;
        }
    }
    if (!PALPATE_IS_F32_(model)) {
        palpate_shift_(model, sums, last);
        for (i = 0; i < model->objects; i++) {
            sums[i] += palpate_u32_(base + 4 * PALPATE_AS_(size_t, i));
        }
    }
}

/* An f32 value, given by its bits, in units of 2^-16, rounded half away from zero, within 2^30. */
static inline int32_t palpate_q16_(uint32_t bits)
{
    const uint32_t limit = PALPATE_AS_(uint32_t, 1) << 30;
    const uint8_t exponent = PALPATE_AS_(uint8_t, bits >> 23);
    uint32_t magnitude = (bits & 0x7fffff) | 0x800000;
    if (exponent < 110 || (exponent == 255 && magnitude != 0x800000)) {
        return 0;
    }
    if (exponent < 134) {
        magnitude = (magnitude + (PALPATE_AS_(uint32_t, 1) << (133 - exponent))) >> (134 - exponent);
    } else {
        magnitude = exponent > 140 ? limit : magnitude << (exponent - 134);
        magnitude = magnitude > limit ? limit : magnitude;
    }
    return bits >> 31 != 0 ? -PALPATE_AS_(int32_t, magnitude) : PALPATE_AS_(int32_t, magnitude);
}

/* Margins where there is room for all. */
static inline void palpate_margins_of_(const palpate_model *model, const int32_t *features, uint16_t count, int32_t *margins)
{
    uint_fast16_t i;
    palpate_sum_(model, features, count, PALPATE_AT_(uint32_t *, margins));
    for (i = 0; PALPATE_IS_F32_(model) && i < model->objects; i++) {
        margins[i] = palpate_q16_(PALPATE_AS_(uint32_t, margins[i]));
    }
}

/* The margins of a row of `count` features, in units: one for each object, within 2^30, in `margins`, which has room for `room` of
 * them. Features are whole numbers, or keys if the model's `real` is 1; PALPATE_MISSING_FEATURE, and what is beyond the end of a
 * short row, is missing. PALPATE_TOO_MANY_OBJECTS, and nothing written, if there are more objects than room. */
PALPATE_API palpate_error palpate_margins_of(const palpate_model *model, const int32_t *features, uint16_t count, int32_t *margins,
                                             size_t room)
{
    if (model->objects > room) {
        return PALPATE_TOO_MANY_OBJECTS;
    }
    palpate_margins_of_(model, features, count, margins);
    return PALPATE_OK;
}

/* The features of a touch in `features`, which has room for PALPATE_TOUCH_FEATURES; returns how many there are: 0 of a
 * model over rows of features. */
PALPATE_API uint16_t palpate_features(const palpate_model *model, const palpate_touch *touch, int32_t *features)
{
    uint32_t times[3];
    if (model->descriptor == 255) {
        return 0;
    }
    palpate_times_(touch, times);
    palpate_features_(model, touch, times, features);
    return model->features;
}

/* The margins of a touch, whether it counts or not; see palpate_margins_of. */
PALPATE_API palpate_error palpate_margins(const palpate_model *model, const palpate_touch *touch, int32_t *margins, size_t room)
{
    int32_t features[PALPATE_TOUCH_FEATURES];
    return palpate_margins_of(model, features, palpate_features(model, touch, features), margins, room);
}

#if PALPATE_LEAVES & PALPATE_F32
/* The sums of a row of features as the trainer's own f32 values, in `margins`, which has room for `room` of them. 0, and nothing
 * written, unless the model has f32 leaves, and no more objects than room and PALPATE_MAX_OBJECTS. */
PALPATE_API int palpate_f32_margins_of(const palpate_model *model, const int32_t *features, uint16_t count, float *margins, size_t room)
{
    union {
        uint32_t bits;
        float value;
    } both;
    uint32_t sums[PALPATE_MAX_OBJECTS];
    uint_fast16_t i;
    if (!PALPATE_IS_F32_(model) || model->objects > PALPATE_MAX_OBJECTS || model->objects > room) {
        return 0;
    }
    palpate_sum_(model, features, count, sums);
    for (i = 0; i < model->objects; i++) {
        both.bits = sums[i];
        margins[i] = both.value;
    }
    return 1;
}
#endif

/* ---- Evidence and verdicts ---- */

/* The high half of a product. */
static inline uint32_t palpate_high_(uint32_t a, uint32_t b)
{
    return PALPATE_AS_(uint32_t, PALPATE_AS_(uint64_t, a) * b >> 32);
}

/* 2^-u in Q56, for u in Q32. Error: at most 1e-8 of the result, and 2^-57. */
PALPATE_API uint64_t palpate_exp2(uint64_t u)
{
    static const uint32_t sixteenths[16] = {
        2147483648u, 2056437387u, 1969251188u, 1885761398u, 1805811301u, 1729250827u, 1655936265u, 1585730000u,
        1518500250u, 1454120821u, 1392470869u, 1333434672u, 1276901417u, 1222764986u, 1170923762u, 1121280436u,
    };
    const uint32_t whole = PALPATE_AS_(uint32_t, u >> 32), rest = PALPATE_AS_(uint32_t, u) << 4;
    uint32_t power = sixteenths[PALPATE_AS_(uint32_t, u) >> 28];
    uint32_t slope = 186065157u - palpate_high_(rest, 4029616u - palpate_high_(rest, 56985u));
    if (whole > 57) {
        return 0;
    }
    power -= palpate_high_(power, palpate_high_(rest, slope));
    return PALPATE_AS_(uint64_t, power) << 25 >> whole;
}

/* Bits in a unit of the evidence of this many touches, when it is compared with a threshold: less than the model's if it states
 * weights of rows that resemble each other. They are the same for `span` numbers of touches, from `from` on. */
static inline uint32_t palpate_bits_(const palpate_model *model, uint32_t touches, uint32_t *from, uint32_t *span)
{
    const uint32_t bits = palpate_u32_(model->bytes + 36);
    const uint8_t *weights = PALPATE_ROW_EVIDENCE ? model->weights_ : NULL;
    uint32_t at = 0, last;
    *from = 0;
    *span = UINT32_MAX;
    if (weights == NULL) {
        return bits;
    }
    /* Two for each doubling; none for what is between 1 and 2. */
    while (touches >> at > 3) {
        at++;
    }
    *from = touches >> at << at;
    *span = PALPATE_AS_(uint32_t, 1) << at;
    at = touches > 1 ? 2 * at + (touches >> at) : 0;
    last = PALPATE_BYTE(weights) - 1u;
    at = palpate_u16_(weights + 2 + 2 * (at < last ? at : last)) + 1;
    return (bits >> 16) * at + ((bits & 0xffff) * at >> 16);
}

/* Bits in a unit of the evidence so far; next to no cost while it stays. */
static inline uint32_t palpate_unit_(palpate_recognizer *recognizer)
{
#if PALPATE_ROW_EVIDENCE
    const uint32_t touches = recognizer->touches;
    if (touches - recognizer->from_ >= recognizer->span_) {
        recognizer->unit_ = palpate_bits_(recognizer->model, touches, &recognizer->from_, &recognizer->span_);
    }
    return recognizer->unit_;
#else
    return palpate_u32_(recognizer->model->bytes + 36);
#endif
}

/* Bits by which an object is behind the leader, in Q32, by the bits in a unit; the largest number where its weight is 0 at any
 * temperature. */
static inline uint64_t palpate_behind_(const palpate_recognizer *recognizer, uint_fast16_t leader, uint_fast16_t object, uint32_t bits)
{
    const uint64_t units = PALPATE_AS_(uint64_t, recognizer->evidence[leader]) - PALPATE_AS_(uint64_t, recognizer->evidence[object]);
    if (units >> 32 != 0) {
        return UINT64_MAX;
    }
    return units * bits >> (PALPATE_BYTE(recognizer->model->bytes + 40) & 63);
}

/* Object with the most evidence among the first `count`; the first of several. */
static inline uint_fast16_t palpate_leader_(const palpate_recognizer *recognizer, uint_fast16_t count)
{
    uint_fast16_t best = 0, i;
    for (i = 1; i < count; i++) {
        if (recognizer->evidence[i] > recognizer->evidence[best]) {
            best = i;
        }
    }
    return best;
}

/* The prior of an object, in units. */
static inline int32_t palpate_prior_(const palpate_model *model, uint_fast16_t object)
{
    return palpate_i32_(model->part_[PALPATE_MARGINS_] + 4 * (PALPATE_AS_(size_t, model->objects) + object));
}

/* A sum that stays within 64 bits. */
static inline int64_t palpate_add_(int64_t a, int64_t b)
{
    if (b >= 0) {
        return a > INT64_MAX - b ? INT64_MAX : a + b;
    }
    return a < INT64_MIN - b ? INT64_MIN : a + b;
}

/* Forgets all touches, for the next object. To expect some objects more often than others, set `evidence` afterwards: the
 * logarithm of each frequency, in units of a margin, up to a constant. */
PALPATE_API void palpate_reset(palpate_recognizer *recognizer)
{
    const palpate_model *model = recognizer->model;
    uint_fast16_t i;
    recognizer->touches = 0;
    recognizer->verdict = PALPATE_UNDECIDED;
    recognizer->object = 0;
    for (i = 0; i < model->objects; i++) {
        recognizer->evidence[i] = palpate_prior_(model, i);
    }
}

/* A recognizer of a model with no more than PALPATE_MAX_OBJECTS objects. */
static inline void palpate_start_(palpate_recognizer *recognizer, const palpate_model *model)
{
    const uint8_t *bytes = model->bytes;
    recognizer->model = model;
    recognizer->odds = palpate_u32_(bytes + 48) | PALPATE_AS_(uint64_t, palpate_u32_(bytes + 52)) << 32;
    recognizer->max_touches = palpate_u32_(bytes + 56);
    recognizer->by_object = 1;
#if PALPATE_ROW_EVIDENCE
    recognizer->from_ = 0;
    recognizer->span_ = 0;
    recognizer->unit_ = 0;
#endif
    palpate_reset(recognizer);
}

/* A recognizer that has touched nothing yet, with the model's own thresholds and limit. For others, set `odds`, `max_touches`
 * and `by_object` afterwards: odds = error rate / (1 - error rate) in Q56. The model must stay where it is. Fails with
 * PALPATE_TOO_MANY_OBJECTS only. */
PALPATE_API palpate_error palpate_start(palpate_recognizer *recognizer, palpate_model *model)
{
    if (model->objects > PALPATE_MAX_OBJECTS) {
        return palpate_wrong_(model, PALPATE_TOO_MANY_OBJECTS, model->bytes + 14);
    }
    palpate_start_(recognizer, model);
    return PALPATE_OK;
}

/* A difference that stays within 64 bits. */
static inline int64_t palpate_subtract_(int64_t a, int64_t b)
{
    if (b >= 0) {
        return a < INT64_MIN + b ? INT64_MIN : a - b;
    }
    return a > INT64_MAX + b ? INT64_MAX : a - b;
}

/* Within 2^31 - 1. */
static inline int32_t palpate_held_(int64_t number)
{
    return number > INT32_MAX ? INT32_MAX : number < -INT32_MAX ? -INT32_MAX : PALPATE_AS_(int32_t, number);
}

/* Divided by a power of two, rounded down. */
static inline int64_t palpate_down_(int64_t number, uint8_t shift)
{
    return number >= 0 ? number >> shift : -1 - ((-1 - number) >> shift);
}

static inline int32_t palpate_i16_(const uint8_t *p)
{
    const int16_t number = PALPATE_AS_(int16_t, palpate_u16_(p));
    return number;
}

/* Evidence for an object without its prior; `is_there` becomes 0 for an object that cannot be there, about which nothing is
 * known. */
static inline int64_t palpate_own_(const palpate_recognizer *recognizer, uint_fast16_t object, int *is_there)
{
    const int64_t sum = recognizer->evidence[object];
    *is_there = *is_there && sum > INT64_MIN / 2;
    return palpate_subtract_(sum, palpate_prior_(recognizer->model, object));
}

/* Misfit of the touches that the evidence is the sum of with the leader, in 2^-16 nats, by the model's test. */
static inline int64_t palpate_misfit_(const palpate_recognizer *recognizer, uint_fast16_t leader)
{
    const uint8_t *test = recognizer->model->strangers_;
    const uint32_t touches = recognizer->touches;
    const uint_fast8_t rivals = PALPATE_BYTE(test + 4);
    const uint8_t *record = test + 36 + PALPATE_AS_(size_t, palpate_record_(rivals) * leader);
    const uint8_t *means = record + 8 + rivals + (rivals & 1), *slopes = means + 2 * rivals, *weights = slopes + 2 * rivals;
    int32_t ahead[16];
    uint64_t squares = 0;
    int64_t slope = 0;
    uint_fast8_t row, column;
    for (row = 0; row < rivals; row++) {
        int is_there = 1;
        const int64_t rival = palpate_own_(recognizer, PALPATE_BYTE(record + 8 + row), &is_there);
        const int64_t own = palpate_own_(recognizer, leader, &is_there);
        int64_t mean = PALPATE_AS_(int64_t, palpate_i16_(means + 2 * row)) * (PALPATE_AS_(int64_t, 1) << PALPATE_BYTE(record));
        const uint64_t size = mean < 0 ? 0u - PALPATE_AS_(uint64_t, mean) : PALPATE_AS_(uint64_t, mean);
        if (size > PALPATE_AS_(uint64_t, INT64_MAX) / touches) {
            mean = mean < 0 ? INT64_MIN : INT64_MAX;
        } else {
            mean *= touches;
        }
        ahead[row] = is_there ? palpate_held_(palpate_subtract_(palpate_subtract_(rival, own), mean)) : 0;
    }
    for (row = 0; row < rivals; row++) {
        int64_t sum = 0;
        uint64_t square;
        for (column = 0; column <= row; column++) {
            sum += PALPATE_AS_(int64_t, palpate_i16_(weights)) * ahead[column];
            weights += 2;
        }
        sum = palpate_held_(palpate_down_(sum, PALPATE_BYTE(record + 1)));
        square = PALPATE_AS_(uint64_t, sum * sum);
        squares = squares > UINT64_MAX - square ? UINT64_MAX : squares + square;
        slope += PALPATE_AS_(int64_t, palpate_i16_(slopes + 2 * row)) * ahead[row];
    }
    squares /= touches;
    squares = squares > INT64_MAX ? INT64_MAX : squares;
    slope = palpate_add_(PALPATE_AS_(int64_t, squares), palpate_down_(slope, PALPATE_BYTE(record + 2)));
    return palpate_subtract_(slope, PALPATE_AS_(int64_t, palpate_i32_(record + 4)) * touches);
}

/* Answer of the model's misfit test for the leader: PALPATE_RECOGNIZED, PALPATE_UNDECIDED or PALPATE_UNKNOWN. */
static inline palpate_verdict palpate_by_misfit_(const palpate_recognizer *recognizer, uint_fast16_t leader)
{
    const palpate_model *model = recognizer->model;
    const uint8_t *test = model->strangers_;
    const uint32_t touches = recognizer->touches;
    uint64_t left;
    int64_t misfit;
    if (test == NULL) {
        return PALPATE_RECOGNIZED;
    }
    if (PALPATE_BYTE(test + 1) != 0) {
        if (touches < palpate_u32_(test + 8)) {
            return PALPATE_UNDECIDED;
        }
        /* The limit is higher at first. */
        left = palpate_exp2(PALPATE_AS_(uint64_t, touches) * palpate_u32_(test + 20)) >> 24;
        misfit = PALPATE_AS_(int64_t, palpate_u32_(test + 16) * left >> 32);
        misfit = palpate_subtract_(palpate_misfit_(recognizer, leader), misfit);
        if (misfit > palpate_i32_(test + 12)) {
            return PALPATE_UNKNOWN;
        }
    }
    if (!PALPATE_HAS_OUTPUTS_(model) && model->known != model->objects &&
        recognizer->evidence[model->known] > recognizer->evidence[leader]) {
        return PALPATE_UNDECIDED; /* the background has more */
    }
    return PALPATE_RECOGNIZED;
}

/* Replaces the margins of a row by its evidence, by the model's table from margins to evidence. */
static inline void palpate_evidence_of_(const palpate_model *model, int32_t *margins)
{
    const uint8_t *row = model->row_;
    const int32_t *end = margins + model->objects;
    const uint32_t most = model->row_most_;
    const int32_t start = model->row_start_;
    for (; margins != end; margins++) {
        const uint8_t *value = row;
        uint32_t beyond = 0, at, rise;
        if (*margins > start) {
            beyond = (PALPATE_AS_(uint32_t, *margins) - PALPATE_AS_(uint32_t, start)) >> PALPATE_BYTE(row + 4);
            beyond = beyond < most ? beyond : most;
        }
        at = beyond >> PALPATE_BYTE(row + 5);
        value += at;
        beyond -= at << PALPATE_BYTE(row + 5);
        at = PALPATE_BYTE(value + 8);
        rise = (PALPATE_BYTE(value + 9) - at) * beyond;
        at <<= PALPATE_BYTE(row + 5);
        *margins = PALPATE_AS_(int32_t, (at + rise) << PALPATE_BYTE(row + 6));
    }
}

/* part / whole in Q56, rounded down, for a part that is at most the whole. */
static inline uint64_t palpate_ratio_(uint64_t part, uint64_t whole)
{
    uint64_t quotient = 0;
    uint_fast8_t i;
    if (part >= whole) {
        return PALPATE_ONE;
    }
    for (i = 0; i < 56; i++) {
        quotient <<= 1;
        /* Twice the rest may not fit, but less the whole it does. */
        if (part >= whole - part) {
            part -= whole - part;
            quotient |= 1;
        } else {
            part <<= 1;
        }
    }
    return quotient;
}

/* One over the model's temperature, in Q16. */
static inline uint32_t palpate_sharpness_(const palpate_model *model)
{
    const uint8_t *p = model->part_[PALPATE_OPTIONAL_], *end = model->part_[PALPATE_MARGINS_];
    uint32_t sharpness = 65536;
    while (p != end) {
        const uint8_t *content = p + 8;
        uint32_t length;
        if ((palpate_section_(&p, &length) & 0x7fff) == 11 && palpate_holds_(length, 4, 0, 0)) {
            const uint32_t stated = palpate_u32_(content);
            sharpness = stated >= 4096 && stated <= 1048576u ? stated : sharpness;
        }
    }
    return sharpness;
}

/* A weight at this sharpness, for evidence this many bits behind. */
static inline uint64_t palpate_sharp_(uint64_t bits, uint32_t sharpness)
{
    const uint64_t most = PALPATE_AS_(uint64_t, 1) << 42; /* where a weight is 0 at any temperature */
    return palpate_exp2((bits < most ? bits : most) * sharpness >> 16);
}

#if PALPATE_OUTPUTS
/* The object that an output belongs to; the background, and an output that there is not, have none. */
static inline uint_fast16_t palpate_object_of_(const palpate_model *model, uint_fast16_t output)
{
    return output < model->known ? PALPATE_BYTE(model->outputs_ + 4 + 4 * PALPATE_AS_(size_t, output)) : PALPATE_NONE_;
}

static inline uint64_t palpate_plus_(uint64_t a, uint64_t b)
{
    return a > UINT64_MAX - b ? UINT64_MAX : a + b;
}

/* True if no object can be recognized, by one exponential: the strongest output of an object other than the leader's weighs
 * more than the loosest threshold times the most outputs of an object. */
static inline int palpate_undecided_(const palpate_recognizer *recognizer, uint64_t loosest, uint32_t bits)
{
    const palpate_model *model = recognizer->model;
    const uint_fast16_t best = palpate_leader_(recognizer, model->objects), own = palpate_object_of_(model, best);
    const uint64_t most = PALPATE_BYTE(model->outputs_) + PALPATE_AS_(uint64_t, 1);
    uint_fast16_t second = PALPATE_NONE_, i;
    for (i = 0; i < model->objects; i++) {
        const uint_fast16_t object = palpate_object_of_(model, i);
        if ((object != own || (own == PALPATE_NONE_ && i != best)) &&
            (second == PALPATE_NONE_ || recognizer->evidence[i] > recognizer->evidence[second])) {
            second = i;
        }
    }
    if (second == PALPATE_NONE_ || loosest > UINT64_MAX / most) {
        return 0;
    }
    return palpate_exp2(palpate_behind_(recognizer, best, second, bits)) > loosest * most;
}

/* The object with the largest sum of its outputs' weights: its output with the most evidence, and what the others weigh in Q56,
 * its own weight being 1; the largest number where it may not be named. */
static inline uint_fast16_t palpate_together_(const palpate_recognizer *recognizer, uint32_t bits, uint64_t *rivals)
{
    const palpate_model *model = recognizer->model;
    const uint_fast16_t best = palpate_leader_(recognizer, model->objects);
    uint64_t own = 0, others = 0, background = 0, sum = 0;
    uint_fast16_t leader = 0, output = 0, i, times = 0;
    if (model->known != model->objects) {
        background = palpate_exp2(palpate_behind_(recognizer, best, model->known, bits));
        others = background;
    }
    for (i = 0; i < model->known; i++) {
        if (i == 0 || palpate_object_of_(model, i) != palpate_object_of_(model, i - 1)) {
            sum = 0;
        }
        if (sum == 0 || recognizer->evidence[i] > recognizer->evidence[output]) {
            output = i;
        }
        sum = palpate_plus_(sum, palpate_exp2(palpate_behind_(recognizer, best, i, bits)));
        if (i + 1u == model->known || palpate_object_of_(model, i) != palpate_object_of_(model, i + 1u)) {
            if (sum > own) {
                others = palpate_plus_(others, own);
                own = sum;
                leader = output;
            } else {
                others = palpate_plus_(others, sum);
            }
        }
    }
    *rivals = UINT64_MAX;
    if (own != 0 && background <= own) {
        while (others >= own && times < 255) {
            others -= own;
            times++;
        }
        *rivals = palpate_plus_(PALPATE_AS_(uint64_t, times) << 56, palpate_ratio_(others, own));
        *rivals = palpate_plus_(*rivals, others != 0);
    }
    return leader;
}

/* The posterior of the object that an output belongs to, in Q56, and the output's share of it: the probability of this
 * placement, given the object. The evidence is divided by the model's temperature. 0 for an output that the model does
 * not have. Cost: an exponential for each output, and two long divisions. */
PALPATE_API uint64_t palpate_posterior_together(const palpate_recognizer *recognizer, uint16_t output, uint64_t *share)
{
    const palpate_model *model = recognizer->model;
    uint32_t from, span;
    const uint32_t bits = palpate_bits_(model, recognizer->touches, &from, &span);
    const uint_fast16_t best = palpate_leader_(recognizer, model->objects);
    const uint32_t sharpness = palpate_sharpness_(model);
    uint64_t own = 0, object = 0, all = 0, rest;
    uint_fast16_t i;
    for (i = 0; i < model->objects; i++) {
        const uint64_t weight = palpate_sharp_(palpate_behind_(recognizer, best, i, bits), sharpness);
        const int is_own = i == output;
        own = is_own ? weight : own;
        if (is_own || (palpate_object_of_(model, i) != PALPATE_NONE_ &&
                       palpate_object_of_(model, i) == palpate_object_of_(model, output))) {
            object = palpate_plus_(object, weight);
        }
        all = palpate_plus_(all, weight);
    }
    rest = all - object;
    *share = object == 0 ? 0 : palpate_ratio_(own, object);
    return all == 0 ? 0 : rest < object ? PALPATE_ONE - palpate_ratio_(rest, all) : palpate_ratio_(object, all);
}
#endif

/* Object with the most evidence among those that can be named; the first of several. If the object has several outputs,
 * whose weights add up, it is the output with the most evidence. */
PALPATE_API uint16_t palpate_best(const palpate_recognizer *recognizer)
{
#if PALPATE_OUTPUTS
    if (recognizer->model->outputs_ != NULL) {
        uint32_t from, span;
        uint64_t rivals;
        const uint32_t bits = palpate_bits_(recognizer->model, recognizer->touches, &from, &span);
        return PALPATE_AS_(uint16_t, palpate_together_(recognizer, bits, &rivals));
    }
#endif
    return PALPATE_AS_(uint16_t, palpate_leader_(recognizer, recognizer->model->known));
}

/* Takes in a touch by its margins, or a row by its evidence. */
static inline void palpate_push_evidence_(palpate_recognizer *recognizer, const int32_t *evidence)
{
    const palpate_model *model = recognizer->model;
    uint64_t left = recognizer->odds;
    palpate_verdict verdict = PALPATE_RECOGNIZED;
    uint32_t bits;
    uint_fast16_t best, i;
    if (recognizer->verdict != PALPATE_UNDECIDED) {
        return;
    }
    for (i = 0; i < model->objects; i++) {
        recognizer->evidence[i] = palpate_add_(recognizer->evidence[i], evidence[i]);
    }
    recognizer->touches += recognizer->touches != UINT32_MAX;
    best = palpate_leader_(recognizer, model->known);
    if (PALPATE_STRANGERS) {
        verdict = palpate_by_misfit_(recognizer, best);
    }
    if (recognizer->by_object != 0 && model->odds_ != NULL) {
        left = PALPATE_AS_(uint64_t, palpate_u32_(model->odds_ + 4 * PALPATE_AS_(size_t, best))) << 24;
    }
    bits = palpate_unit_(recognizer);
#if PALPATE_OUTPUTS
    if (model->outputs_ != NULL && verdict == PALPATE_RECOGNIZED) {
        uint64_t loosest = recognizer->odds, rivals;
        if (recognizer->by_object != 0 && model->odds_ != NULL) {
            for (loosest = 0, i = 0; i < model->objects; i++) {
                const uint64_t own = PALPATE_AS_(uint64_t, palpate_u32_(model->odds_ + 4 * PALPATE_AS_(size_t, i))) << 24;
                loosest = own > loosest ? own : loosest;
            }
        }
        verdict = PALPATE_UNDECIDED;
        if (!palpate_undecided_(recognizer, loosest, bits)) {
            best = palpate_together_(recognizer, bits, &rivals);
            if (recognizer->by_object != 0 && model->odds_ != NULL) {
                left = PALPATE_AS_(uint64_t, palpate_u32_(model->odds_ + 4 * PALPATE_AS_(size_t, best))) << 24;
            }
            verdict = rivals <= left && rivals != UINT64_MAX ? PALPATE_RECOGNIZED : PALPATE_UNDECIDED;
        }
    } else
#endif
    for (i = 0; verdict == PALPATE_RECOGNIZED && i < model->objects; i++) {
        if (i != best) {
            const uint64_t weight = palpate_exp2(palpate_behind_(recognizer, best, i, bits));
            if (weight > left) {
                verdict = PALPATE_UNDECIDED;
            }
            left -= weight;
        }
    }
    if (verdict == PALPATE_UNDECIDED && recognizer->touches >= recognizer->max_touches) {
        verdict = PALPATE_GAVE_UP;
    }
    recognizer->verdict = PALPATE_AS_(uint8_t, verdict);
    recognizer->object = PALPATE_AS_(uint8_t, best);
}

/* Takes in a touch or row by its first `count` margins; missing ones add nothing. */
PALPATE_API void palpate_push_margins(palpate_recognizer *recognizer, const int32_t *margins, size_t count)
{
    int32_t evidence[PALPATE_MAX_OBJECTS];
    uint_fast16_t i;
    for (i = 0; i < recognizer->model->objects; i++) {
        evidence[i] = i < count ? margins[i] : 0;
    }
    if (PALPATE_ROW_EVIDENCE && recognizer->model->row_ != NULL) {
        palpate_evidence_of_(recognizer->model, evidence);
        for (i = 0; i < recognizer->model->objects; i++) {
            evidence[i] = i < count ? evidence[i] : 0;
        }
    }
    palpate_push_evidence_(recognizer, evidence);
}

/* Takes in a touch; after a decision nothing changes until the reset. Cost: the ensemble's margins, a few instructions for
 * each object, and an exponential, rarely more. */
PALPATE_API palpate_answer palpate_push(palpate_recognizer *recognizer, const palpate_touch *touch)
{
    int32_t features[PALPATE_TOUCH_FEATURES], margins[PALPATE_MAX_OBJECTS];
    uint32_t times[3];
    palpate_answer answer;
    palpate_times_(touch, times);
    answer = palpate_accepts_(recognizer->model, touch, times);
    if (answer == PALPATE_COUNTED && recognizer->verdict == PALPATE_UNDECIDED) {
        palpate_features_(recognizer->model, touch, times, features);
        palpate_margins_of_(recognizer->model, features, recognizer->model->features, margins);
        palpate_push_evidence_(recognizer, margins);
    }
    return answer;
}

/* Takes in a row of features; see palpate_margins_of. */
PALPATE_API palpate_answer palpate_push_features(palpate_recognizer *recognizer, const int32_t *features, uint16_t count)
{
    int32_t margins[PALPATE_MAX_OBJECTS];
    if (recognizer->model->descriptor != 255) {
        return PALPATE_NEEDS_TOUCHES;
    }
    palpate_margins_of_(recognizer->model, features, count, margins);
    if (PALPATE_ROW_EVIDENCE && recognizer->model->row_ != NULL) {
        palpate_evidence_of_(recognizer->model, margins);
    }
    palpate_push_evidence_(recognizer, margins);
    return PALPATE_COUNTED;
}

#if PALPATE_SEQUENCES
/* The value of a feature in the last row of a sequence, and the number of rows that it has been the same. */
typedef struct {
    int32_t value;
    uint32_t equal;
} palpate_last;

/* Makes the next row of a sequence ready for palpate_push_features. `features` are all of the model's; that of the row's number,
 * if it has one, is filled in. `rows` is the number of rows before, 0 where a sequence begins, and is counted on. `last` has room
 * for each feature if the model states which rows it takes, and may be NULL otherwise. The result is 0, or the number, counted from
 * 1, of the first feature that the model does not take: such a row is not to be pushed. Cost: a few instructions for each feature. */
PALPATE_API uint16_t palpate_next_row(const palpate_model *model, uint32_t *rows, palpate_last *last, int32_t *features)
{
    const uint8_t *limits = model->guard_;
    const int is_first = *rows == 0;
    uint16_t refused = 0;
    uint_fast16_t i;
    *rows += *rows != UINT32_MAX;
    if (model->position_ != NULL) {
        const uint32_t most = PALPATE_AS_(uint32_t, 1) << 24, number = *rows < most ? *rows : most;
        const int32_t step = palpate_i32_(model->position_ + 4);
        features[PALPATE_BYTE(model->position_)] = model->real ? palpate_f32_key(PALPATE_AS_(float, number))
            : number > PALPATE_AS_(uint32_t, INT32_MAX / step) ? INT32_MAX : PALPATE_AS_(int32_t, number) * step;
    }
    for (i = 0; limits != NULL && i < model->features; i++, limits += 12) {
        const uint32_t stated = palpate_u32_(limits + 8), most_equal = stated & 0x7fffffffu;
        int32_t value = features[i];
        int is_refused;
        if (PALPATE_SENTINEL && model->sentinel_ != NULL && palpate_i32_(model->sentinel_) <= value &&
            value <= palpate_i32_(model->sentinel_ + 4)) {
            value = PALPATE_MISSING_FEATURE;
        }
        if (is_first || value != last[i].value) {
            last[i].equal = 0;
        }
        last[i].value = value;
        last[i].equal += last[i].equal != UINT32_MAX;
        is_refused = value == PALPATE_MISSING_FEATURE ? stated >> 31 == 0 : value < palpate_i32_(limits) || value > palpate_i32_(limits + 4);
        if (refused == 0 && (is_refused || (most_equal != 0 && last[i].equal > most_equal))) {
            refused = PALPATE_AS_(uint16_t, i + 1);
        }
    }
    return refused;
}

/* Number of rows that were pushed in a sequence. */
static inline uint32_t palpate_rows_(const palpate_recognizer *recognizer)
{
    return recognizer->touches;
}
#endif

/* The posterior of an object in Q56 (PALPATE_ONE is 1), from the evidence divided by the model's temperature; 0 for an object
 * that the model does not know. Cost: an exponential for each object, and a long division. */
PALPATE_API uint64_t palpate_posterior(const palpate_recognizer *recognizer, uint16_t object)
{
    const palpate_model *model = recognizer->model;
    const uint_fast16_t best = palpate_leader_(recognizer, model->objects);
    uint32_t from, span;
    const uint32_t unit = palpate_bits_(model, recognizer->touches, &from, &span);
    const uint32_t sharpness = palpate_sharpness_(model);
    uint64_t own = 0, others = 0, all;
    uint_fast16_t i;
    if (object >= model->objects) {
        return 0;
    }
    for (i = 0; i < model->objects; i++) {
        if (i != best) {
            const uint64_t weight = palpate_sharp_(palpate_behind_(recognizer, best, i, unit), sharpness);
            others += weight;
            own = i == object ? weight : own;
        }
    }
    /* 256 objects that are level are as much as does not fit. */
    all = others > UINT64_MAX - PALPATE_ONE ? UINT64_MAX : PALPATE_ONE + others;
    return object == best ? PALPATE_ONE - palpate_ratio_(others, all) : palpate_ratio_(own, all);
}

/* ---- Predictions for rows of features ---- */

/* The section about what margins become; NULL if there is none. */
static inline const uint8_t *palpate_prediction_(const palpate_model *model)
{
    const uint8_t *p = model->part_[PALPATE_OPTIONAL_], *end = model->part_[PALPATE_MARGINS_];
    while (p != end) {
        const uint8_t *content = p + 8;
        uint32_t length;
        if ((palpate_section_(&p, &length) & 0x7fff) == 13) {
            return content;
        }
    }
    return NULL;
}

/* The class with the largest of the sums. */
static inline uint16_t palpate_best_of_(const palpate_model *model, const int32_t *sums)
{
    const uint8_t *prediction = palpate_prediction_(model);
    const int last_of_ties = prediction != NULL && PALPATE_BYTE(prediction + 1) != 0;
    int32_t most = INT32_MIN;
    uint_fast16_t best = 0, i;
    for (i = 0; i < model->known; i++) {
        const int32_t sum = PALPATE_IS_F32_(model) ? palpate_key(PALPATE_AS_(uint32_t, sums[i])) : sums[i];
        if (sum > most || (last_of_ties && sum == most)) {
            best = i;
            most = sum;
        }
    }
    return PALPATE_AS_(uint16_t, best);
}

/* The class of a row of `count` features (see palpate_margins_of): that with the largest margin, and of several the first,
 * or the last where the model says so. With f32 leaves their sums are compared as they are. `margins` has room for
 * `room` of them, and then holds the row's. PALPATE_NO_CLASS, and nothing written, if there are more objects than room. */
PALPATE_API uint16_t palpate_predict_class(const palpate_model *model, const int32_t *features, uint16_t count, int32_t *margins,
                                           size_t room)
{
    const uint8_t *prediction = palpate_prediction_(model);
    const int last_of_ties = prediction != NULL && PALPATE_BYTE(prediction + 1) != 0;
    int32_t most = INT32_MIN;
    uint_fast16_t best = 0, i;
    if (model->objects > room) {
        return PALPATE_NO_CLASS;
    }
    palpate_sum_(model, features, count, PALPATE_AT_(uint32_t *, margins));
    for (i = 0; i < model->objects; i++) {
        int32_t sum = margins[i];
        if (PALPATE_IS_F32_(model)) {
            margins[i] = palpate_q16_(PALPATE_AS_(uint32_t, sum));
            sum = palpate_key(PALPATE_AS_(uint32_t, sum));
        }
        if (i < model->known && (sum > most || (last_of_ties && sum == most))) {
            best = i;
            most = sum;
        }
    }
    return PALPATE_AS_(uint16_t, best);
}

/* The f32 value with these bits. */
static inline float palpate_float_(uint32_t bits)
{
    union {
        uint32_t bits;
        float value;
    } both;
    both.bits = bits;
    return both.value;
}

/* The sum of an output as an f32 value before the inverse link: times the scale that the model states, and with `whole` plus
 * the output's offset. */
static inline float palpate_raw_(const palpate_model *model, uint_fast16_t output, uint32_t sum, int whole)
{
    const uint8_t *prediction = palpate_prediction_(model);
    const uint8_t link = PALPATE_AS_(uint8_t, prediction == NULL ? 0 : PALPATE_BYTE(prediction));
    const uint8_t *own = (link & 64) == 0 ? NULL : prediction + (link > 127 ? 12 : 8) + 8 * output;
    const float unit = palpate_float_(palpate_u32_(model->bytes + 32));
    const float scale =
        palpate_float_(own != NULL ? palpate_u32_(own) : prediction == NULL ? 0x3f800000u : palpate_u32_(prediction + 4));
    /* Not to be added before it is rounded. */
    const volatile float value =
        PALPATE_IS_F32_(model) ? palpate_float_(sum) * scale : PALPATE_AS_(float, PALPATE_AS_(int32_t, sum)) * (unit * scale);
    return own != NULL && whole ? value + palpate_float_(palpate_u32_(own + 4)) : value;
}

/* The value of a row of `count` features before the inverse link: the margin of a model with one output, times the scale
 * and plus the offset that the model states; 0 for a model with several outputs. The bits are the crate's if the compiler
 * computes in f32 (no excess precision). */
PALPATE_API float palpate_predict_raw(const palpate_model *model, const int32_t *features, uint16_t count)
{
    uint32_t sum;
    if (model->objects != 1) {
        return 0;
    }
    palpate_sum_(model, features, count, &sum);
    return palpate_raw_(model, 0, sum, 1);
}

/* e^x: within 1e-7 of the result. */
static inline float palpate_exp_(float x)
{
    union {
        float value;
        uint32_t bits;
    } both;
    uint32_t exponent, fraction;
    uint64_t power;
    int whole, half;
    both.value = x;
    if ((both.bits & 0x7fffffff) > 0x7f800000) {
        return x; /* NaN */
    }
    if (x > 89.0f) {
        return palpate_float_(0x7f800000u);
    }
    if (x < -104.0f) {
        return 0;
    }
    exponent = both.bits >> 23 & 255;
    /* |x| log2 e in Q32. */
    power = PALPATE_AS_(uint64_t, (both.bits & 0x7fffff) | 0x800000) * 793129986396u;
    power = exponent < 94 ? 0 : power >> (157 - exponent);
    whole = PALPATE_AS_(int, power >> 32);
    fraction = PALPATE_AS_(uint32_t, power);
    if (x < 0) {
        whole = -whole;
    } else if (fraction != 0) {
        whole++;
        fraction = 0u - fraction;
    }
    whole -= 24;
    half = whole / 2;
    power = (palpate_exp2(fraction) + (PALPATE_AS_(uint32_t, 1) << 31)) >> 32;
    return PALPATE_AS_(float, PALPATE_AS_(uint32_t, power)) * palpate_float_(PALPATE_AS_(uint32_t, 127 + half) << 23) *
           palpate_float_(PALPATE_AS_(uint32_t, 127 + whole - half) << 23);
}

/* ln(1 + e), for e from 0 to 1. */
static inline float palpate_ln_1p_(float e)
{
    const float s = e / (2.0f + e), t = s * s;
    float sum = 1.0f / 13;
    int divisor;
    for (divisor = 11; divisor > 0; divisor -= 2) {
        sum = sum * t + 1.0f / PALPATE_AS_(float, divisor);
    }
    return 2.0f * s * sum;
}

/* The library's prediction for a margin, by the model's inverse link; for averaged trees that of their mean. Error, relative to
 * the result: at most 5e-7. */
PALPATE_API float palpate_inverse_link(const palpate_model *model, float margin)
{
    const uint8_t *prediction = palpate_prediction_(model);
    const uint8_t link = PALPATE_AS_(uint8_t, prediction == NULL ? 0 : PALPATE_BYTE(prediction));
    if (link > 127) {
        margin /= PALPATE_AS_(float, palpate_u32_(prediction + 8));
    }
    switch (link & 63) {
    case 1:
        if (margin >= 0) {
            return 1.0f / (1.0f + palpate_exp_(-margin));
        }
        margin = palpate_exp_(margin);
        return margin / (1.0f + margin);
    case 2:
        return palpate_exp_(margin);
    case 3:
        return margin < 0 ? -(margin * margin) : margin * margin;
    case 4:
        return margin > 0 ? margin + palpate_ln_1p_(palpate_exp_(-margin)) : palpate_ln_1p_(palpate_exp_(margin));
    default:
        return margin;
    }
}

/* The value of a row of `count` features as the library predicts it: palpate_predict_raw after the inverse link. */
PALPATE_API float palpate_predict_value(const palpate_model *model, const int32_t *features, uint16_t count)
{
    return palpate_inverse_link(model, palpate_predict_raw(model, features, count));
}

/* ---- Calls of a model that `palpate export` wrote ---- */

/* The values of a row by its sums. */
static inline void palpate_values_of_(const palpate_model *model, const uint32_t *sums, float *values)
{
    uint_fast16_t i;
    for (i = 0; i < model->objects; i++) {
        values[i] = palpate_inverse_link(model, palpate_raw_(model, i, sums[i], 1));
    }
}

/* The values of a row by its sums, without the offsets of outputs. */
static inline void palpate_differences_of_(const palpate_model *model, const uint32_t *sums, float *values)
{
    uint_fast16_t i;
    for (i = 0; i < model->objects; i++) {
        values[i] = palpate_raw_(model, i, sums[i], 0);
    }
}

/* Probabilities of a row by its sums in nats: a softmax, or with `apart` the logistic function of each, as where classes were
 * trained one against all others. */
static inline void palpate_posteriors_of_(const palpate_model *model, const uint32_t *sums, int apart, float *posteriors)
{
    const float unit = palpate_float_(palpate_u32_(model->bytes + 32));
    const uint32_t most = apart ? 0 : sums[palpate_best_of_(model, PALPATE_AT_(const int32_t *, sums))];
    float all = 0;
    uint_fast16_t i;
    for (i = 0; i < model->objects; i++) {
        /* The difference of two sums is exact in units. */
        const float behind = PALPATE_IS_F32_(model) ? palpate_float_(sums[i]) - palpate_float_(most)
                                                    : PALPATE_AS_(float, PALPATE_AS_(int32_t, sums[i] - most)) * unit;
        posteriors[i] = apart ? 1.0f / (1.0f + palpate_exp_(-behind)) : palpate_exp_(behind);
        all += posteriors[i];
    }
    for (i = 0; !apart && i < model->objects; i++) {
        posteriors[i] /= all;
    }
}

/* The object that was recognized, or -1 while undecided, -2 where none fits, -3 where the limit was reached. */
static inline int palpate_decided_(const palpate_recognizer *recognizer)
{
    const int verdict = recognizer->verdict;
    return verdict == PALPATE_RECOGNIZED ? recognizer->object : verdict == PALPATE_UNDECIDED ? -1 : -verdict;
}

/* The decision, or without one the object with the most evidence, -1 if there is none. */
static inline int palpate_ended_(const palpate_recognizer *recognizer)
{
    const int decided = palpate_decided_(recognizer);
    return decided >= 0 || decided == -2 ? decided : recognizer->touches == 0 ? -1 : PALPATE_AS_(int, palpate_best(recognizer));
}

/* A step of a model that computes its features. */
typedef palpate_touch palpate_step;

/* Adds a touch, and answers as palpate_decided_ does. */
static inline int palpate_add_step_(palpate_recognizer *recognizer, const palpate_step *touch)
{
    (void)palpate_push(recognizer, touch);
    return palpate_decided_(recognizer);
}

/* Adds a touch by its times. */
static inline int palpate_add_times_(palpate_recognizer *recognizer, const uint32_t *times)
{
    const palpate_touch touch = {{times[0], times[1], times[2]}, 0, {0, 0, 0}, {0, 0, 0}};
    return palpate_add_step_(recognizer, &touch);
}

/* PALPATE_OK if the bytes of an opened model still have its checksum, else PALPATE_CHECKSUM. Cost: in proportion to the bytes. */
static inline palpate_error palpate_check_(const palpate_model *model)
{
    const uint8_t *p = model->bytes;
    uint32_t sum = 0xffffffffu;
    for (; p != model->part_[PALPATE_END_]; p++) {
        sum = palpate_crc_(sum, PALPATE_BYTE(p));
    }
    return ~sum == palpate_u32_(p) ? PALPATE_OK : PALPATE_CHECKSUM;
}

#endif
