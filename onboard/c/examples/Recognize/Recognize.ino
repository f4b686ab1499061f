// Recognizes an object from three switches on pins 2, 3 and 4, the fingers of a probe, and prints its name.
//
// model.h is a toy of two objects. Replace it with your own: palpate export ensemble.json -o model.palpate --emit c

#include "model.h"

static palpate_model model;
static palpate_recognizer recognizer;

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

// Waits for a touch: until all switches are closed, or the time is over within which fingers follow the first one.
static void touch(palpate_touch &touched) {
  const uint32_t longest = model.largest_spread < 1000000 ? model.largest_spread : 1000000;
  uint32_t first = 0;
  uint8_t count = 0;
  touched.has_pose = 0;
  for (uint8_t finger = 0; finger < 3; finger++) {
    touched.times[finger] = PALPATE_MISSING;
  }
  while (count < 3 && (count == 0 || micros() - first <= longest)) {
    for (uint8_t finger = 0; finger < 3; finger++) {
      if (touched.times[finger] == PALPATE_MISSING && digitalRead(static_cast<uint8_t>(2 + finger)) == LOW) {
        const uint32_t now = micros();
        first = count == 0 ? now : first;
        touched.times[finger] = now - first;
        count++;
      }
    }
  }
  // Until the probe is back, and no switch bounces.
  while (digitalRead(2) == LOW || digitalRead(3) == LOW || digitalRead(4) == LOW) {
  }
  delay(20);
}

void loop() {
  palpate_touch touched;
  touch(touched);
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
