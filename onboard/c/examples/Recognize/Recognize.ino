// Recognizes an object from three switches on pins 2, 3 and 4, the fingers of a probe, and prints its name.
//
// model.h is a toy of two objects. Replace it with your own: palpate export ensemble.json -o model.palpate --emit c

#include "model.h"

// In microseconds: how long a level holds before a switch has settled, how long a switch may bounce, how long all switches
// are open before a touch ends without its missing contacts, and how long after a touch before the next one begins.
static const uint32_t DEBOUNCE = 5000, SETTLE = 25000, RELEASE = 100000, REST = 10000;

struct Finger {
  bool level, closed;     // as read last, and as it settled last
  bool moving, bouncing;  // has not settled; for longer than it may
  bool touched;           // in this touch, at `contact`
  uint32_t changed, left, contact;  // the last edge, and the first one since it had settled
};

enum State { RESTING, WAITING, TOUCHING };

static palpate_model model;
static palpate_recognizer recognizer;
static Finger fingers[3];
static State state = RESTING;
static uint32_t rest = RELEASE;  // at the start an approach may be going on
static uint32_t open_since;
static bool all_open;

void setup() {
  Serial.begin(115200);
  for (uint8_t pin = 2; pin <= 4; pin++) {
    pinMode(pin, INPUT_PULLUP);
  }
  if (palpate_open(&model, model_model, sizeof model_model) != PALPATE_OK ||
      palpate_start(&recognizer, &model) != PALPATE_OK) {
    Serial.print("This is no model; wrong at byte ");
    Serial.println(model.wrong);
    while (true) {
    }
  }
}

// The time within which fingers follow the first one: a sixteenth more than in any touch that the model was trained on.
static uint32_t longest() {
  const uint32_t spread = model.largest_spread;
  if (spread == UINT32_MAX) {
    return 1200000;  // The model does not say.
  }
  return spread < 1000000000 ? spread + spread / 16 + 1 : 1073741824;
}

// Drops what has touched so far: the next touch begins when all switches have been open for `time`.
static void end_touch(uint32_t time) {
  state = RESTING;
  rest = time;
  for (Finger &finger : fingers) {
    finger.touched = false;
  }
}

// Settles switches whose level has held, and drops the touch of one that bounces for too long.
static void settle(uint32_t now) {
  for (Finger &finger : fingers) {
    if (finger.moving && now - finger.changed >= DEBOUNCE) {
      if (finger.level && !finger.closed && state != RESTING) {
        state = TOUCHING;
        if (!finger.touched) {
          finger.touched = true;
          finger.contact = finger.bouncing ? finger.changed : finger.left;
        }
      }
      finger.closed = finger.level;
      finger.moving = finger.bouncing = false;
    } else if (finger.moving && !finger.bouncing && now - finger.left >= SETTLE) {
      finger.bouncing = true;
      if (state != RESTING) {
        end_touch(RELEASE);
      }
    }
  }
}

// Whether the touch in progress is over; if so, what it was.
static bool is_over(uint32_t now, palpate_touch &touched) {
  uint32_t first = now;
  uint8_t count = 0;
  for (const Finger &finger : fingers) {
    if (finger.touched) {
      first = now - finger.contact > now - first ? finger.contact : first;
      count++;
    }
  }
  bool waits = false;  // for a finger that began to close in time and has not settled
  for (const Finger &finger : fingers) {
    waits = waits || (!finger.touched && !finger.closed && finger.moving && now - finger.left > now - first - longest());
  }
  const bool late = now - first >= longest() && !waits;
  if (count < 3 && !late && !(all_open && now - open_since >= RELEASE)) {
    return false;
  }
  touched.has_pose = 0;
  for (uint8_t i = 0; i < 3; i++) {
    const uint32_t time = fingers[i].contact - first;
    touched.times[i] = fingers[i].touched && time < longest() ? time : PALPATE_MISSING;
  }
  end_touch(REST);
  return true;
}

// Reads the switches once. Call it at least once a millisecond: contact times are right to the time between two calls.
static bool look(palpate_touch &touched) {
  const uint32_t now = micros();
  settle(now);
  bool all = true;
  for (const Finger &finger : fingers) {
    all = all && !finger.closed && !finger.moving;
  }
  open_since = all && !all_open ? now : open_since;
  all_open = all;
  const bool over = state == TOUCHING && is_over(now, touched);
  if (state == RESTING && all_open && now - open_since >= rest) {
    state = WAITING;
  }
  for (uint8_t i = 0; i < 3; i++) {
    Finger &finger = fingers[i];
    const bool level = digitalRead(static_cast<uint8_t>(2 + i)) == LOW;
    if (level != finger.level) {
      finger.left = finger.moving ? finger.left : now;
      finger.level = level;
      finger.moving = true;
      finger.changed = now;
    }
  }
  return over;
}

void loop() {
  palpate_touch touched;
  if (!look(touched)) {
    return;
  }
  if (palpate_push(&recognizer, &touched) != PALPATE_COUNTED) {
    Serial.println("The model was not trained on such touches.");
    return;
  }
  if (recognizer.verdict == PALPATE_RECOGNIZED) {
    char name[32];
    palpate_object_name(&model, recognizer.object, name, sizeof name);
    Serial.println(name);
  } else if (recognizer.verdict == PALPATE_UNKNOWN) {
    Serial.println("unknown");
  }
  if (recognizer.verdict != PALPATE_UNDECIDED) {
    palpate_reset(&recognizer);
  }
}
