/* Stub with as much of ESP-IDF as the example needs, so that a compiler can check it. */
void vTaskDelay(unsigned ticks);
